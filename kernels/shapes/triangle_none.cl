/* Stands for shapes/triangle.cl where nothing asks for more than the flat triangle. */
#define surface_triangle(scene, shape, space, prim, active, s)
