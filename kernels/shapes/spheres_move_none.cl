/* Stands for shapes/spheres_move.cl where spheres do not move by themselves, or no layer tells how. */
#define spheres_move(scene, shape, prim, analytic, motion, rest, s)
