/* Stands for media/grid_mixed.cl where all grids are of one part. */
#define grid_mixed(scene, name, w, active, bits, lambdas, m)
