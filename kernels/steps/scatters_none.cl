/* Stands for steps/scatters.cl at null surfaces, where a path has no new direction. */
#define path_scatters(path, at, next, null, v, scatter, rival, bs, onward)
