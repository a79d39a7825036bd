/* Stands for shapes/second_uv.cl where no map lies on a second set of uv. */
#define triangle_second_uv(scene, shape, space, c, s)
