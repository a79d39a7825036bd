/* Stands for transport/vertex_names.cl where no layer names what is seen. */
#define vertex_names(scene, hit, at, active, v)
