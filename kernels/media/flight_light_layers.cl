/* Adds emission of media to its light layers, whose group follows the groups of all lights. */
#include "film/light_layers.cl"
#define flight_light_layers(scene, path, at, flies, state, light)                                                   \
    light_layers_add(scene, path, at, flies, (state) & PATH_DEPTH, (integer)((scene).settings->light_count), light, \
                     light_layers)

/* Twin, where the film has no layers of lights. */
#define flight_light_layers(scene, path, at, flies, state, light)
