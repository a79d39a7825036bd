/* Stands for lights/join_light.cl where light paths do not show lights to the camera. */
#define light_joined(scene, shadow, at, ended, go, sampler, s, r, lambdas) ((integer)(0))
