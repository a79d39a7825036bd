/* Stands for shapes/analytic.cl where all is made of triangles. */
#define surface_analytic(scene, shape, prim, active, end, s)
