/* Stands for film/layers.cl where there are none beside the picture. */
#define layers_count(scene, path, at, layers, unseen)
