/* Adds light of media to the layers of the group that is told behind those of all lights. */
#include "film/light_layers.cl"
#define flight_light_layers(scene, path, at, flies, state, light)                                                   \
    light_layers_add(scene, path, at, flies, (state) & PATH_DEPTH, (integer)((scene).settings->light_count), light, \
                     light_layers)

/* Twin, where no layers of light are wanted. */
#define flight_light_layers(scene, path, at, flies, state, light)
