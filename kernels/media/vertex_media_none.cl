/* Stands for media/vertex_media.cl where there are no media. */
typedef integer VertexMedia;
#define vertex_media(scene, path, hit, at, active, row, front) ((integer)(0))
