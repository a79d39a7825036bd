/* Stands for film/covers.cl where the film has no alpha. */
#define path_covers(scene, path, at, end, lambdas, start) ((real)(1.0f))
