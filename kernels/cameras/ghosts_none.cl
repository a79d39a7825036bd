/* Stands for cameras/ghosts.cl where a lens has none, or light paths do not bring them. */
#define ghost_bit(scene, pixel_index, sample) ((integer)(0))
#define left_to_flare(state, depth) mask_of(0)
