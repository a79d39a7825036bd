/* Stands for shapes/analytic_tangents.cl where nothing asks for directions along a surface. */
#define analytic_tangents(scene, shape, prim, analytic, motion, rest, s)
