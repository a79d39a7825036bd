/* Stands for integrator/steps/light_path_roulette.cl at null surfaces, where nothing is lost. */
#define light_path_roulette(scene, path, at, next, null, v, scatter, beta) (next)
