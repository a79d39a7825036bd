/* Stands for integrator/steps/escapes.cl where no medium is sealed by a smooth boundary. */
#define path_escapes(scene, path, shadow, at, next, v, scatter, bs, onward) ((integer)(0))
