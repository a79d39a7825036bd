/* Stands for media/grid_glow.cl where no grid has a temperature. */
#define grid_glow(scene, at, number, active, lambdas, light) (light)
