/* Stands for shapes/attributes.cl where no texture reads attributes. */
#define surface_attributes(scene, shape, prim, active, s)
#define surface_attributes_tell(s, t)
#define surface_attributes_move(s, u, v, t)
