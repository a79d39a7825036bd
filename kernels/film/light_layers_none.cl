/* Stands for film/light_layers.cl where there are none. */
#define light_layers_add(scene, path, at, m, surfaces, row, light, light_layers)
#define light_layers_chosen(path, at, m, row)
