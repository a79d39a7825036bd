/* Stands for media/vertex_media_ways.cl where there are no media. */
#define vertex_arriving(scene, path, at, active, v) ((v).beta)
#define vertex_beyond(scene, v, w, t, lambdas, value) (value)
