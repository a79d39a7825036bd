/* Stands for media/flight_light_layers.cl where no layers of light are wanted. */
#define flight_light_layers(scene, path, at, flies, state, light)
