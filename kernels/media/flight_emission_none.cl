/* Stands for media/flight_emission.cl where no medium emits. */
#define flight_emission(scene, flies, name, m, end, lambdas) spectrum_of(0.0f)
#define flight_light(scene, path, at, flies, state, light)
