/* Stands for shapes/triangle_uv.cl where no mesh has uv. */
#define triangle_uv(scene, shape, space, c, s)
