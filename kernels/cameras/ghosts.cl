/* Samples that follow light which surfaces of the lens have reflected, as cameras/kinds/lens.cl chooses. Light that
 * such a path would meet by its first ray is left to paths from lights (stage/flare.cl). */
inline integer ghost_bit(Scene scene, integer pixel_index, integer sample)
{
    Sampler sampler = pixel_sampler(scene.settings, pixel_key(scene.settings, pixel_index), sample);
    real share = ((global const LensCamera *)scene.camera)->ghosts;
    mask ghost = sampler_pair(sampler, (natural)(DIMENSION_LENS)).x < share;
    return sel_i(ghost, (integer)(PATH_GHOST), (integer)(0));
}

inline mask left_to_flare(integer state, integer depth) { return (depth == 0) & ((state & PATH_GHOST) != 0); }

/* Twin, where a lens has none, or light paths do not bring them. */
inline integer ghost_bit(Scene scene, integer pixel_index, integer sample) { return (integer)(0); }
inline mask left_to_flare(integer state, integer depth) { return mask_of(0); }
