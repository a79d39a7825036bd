/* Stands for media/grid_gather.cl where no grid emits. */
#define grid_gather(scene, name, m, w, b, to, passed, dims, bits, active, f, lambdas, origin)
