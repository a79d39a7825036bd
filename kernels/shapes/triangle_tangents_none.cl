/* Stands for shapes/triangle_tangents.cl where no mesh has tangents, or nothing asks for them. */
#define triangle_tangents(scene, shape, space, c, s)
