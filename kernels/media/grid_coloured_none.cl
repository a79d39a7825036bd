/* Stands for media/grid_coloured.cl where extinction has no colours on a grid. */
#define grid_coloured(scene, name, w, active, bits, lambdas, m)
