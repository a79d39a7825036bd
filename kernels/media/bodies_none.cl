/* Stands for media/bodies.cl where bodies do not overlap: a ray to a light knows its medium by name. */
#define camera_through(settings) ((integer)((settings)->camera_medium))
#define light_through(scene, row) light_medium(scene, row)
