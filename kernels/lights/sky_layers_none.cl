/* Stands for lights/sky_layers.cl where there are no layers of light, or none comes from all around. */
#define sky_layers(scene, path, at, end, lambdas, light_layers)
