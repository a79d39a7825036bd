/* Stands for integrator/steps/roulette.cl at null surfaces, where nothing is lost. */
#define path_roulette(scene, path, at, next, null, v, scatter, guided, eta, beta) (next)
