/* Stands for media/medium_dims.cl where a ray may go through several media: it is dimmed as it is traced, see
 * tracing/transmittance_media.cl. */
#define medium_dims(scene, medium, t, lambdas, value) (value)
