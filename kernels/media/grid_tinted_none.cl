/* Stands for media/grid_tinted.cl where no albedo is on a grid. */
#define grid_tinted(scene, name, w, active, bits, lambdas, m)
