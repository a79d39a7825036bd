/* Stands for lights/light_kept.cl where light paths are not weighed. */
#define light_kept(path, at, go, r)
