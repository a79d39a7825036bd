/* Stands for lights/sky.cl in a scene without light from all around. */
#define sky_gather(scene, path, at, end, lambdas, radiance) (radiance)
#define sky_due(end) any((end).ended)
