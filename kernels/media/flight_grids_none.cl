/* Stands for media/flight_grids.cl where there are no grids. */
#define flight_grids(scene, path, at, flies, name, r, ratio, lambdas, light, weight, collides, t, m)
