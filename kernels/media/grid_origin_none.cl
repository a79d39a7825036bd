/* Stands for media/grid_origin.cl where no grid emits. */
#define grid_origin_load(path, at, r, origin)
