/* Stands for media/grid_way.cl where there are no grids. */
#define grid_way_key(scene, path, at) ((natural)(0u))
#define grid_way(scene, medium, o, d, way, key, active, lambdas, dims) (dims)
