/* Stands for film/layers_record.cl where there are none beside the picture. */
#define layers_record(scene, path, at, layers, met, v, scatter, state) (state)
#define scout_vertex(scene, path, at, layers, active, v) (active)
