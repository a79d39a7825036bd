/* Stands for integrator/steps/scatters.cl at null surfaces, where a path has no new direction. */
#define path_scatters(scene, path, at, next, null, v, scatter, rival, bs, onward)
