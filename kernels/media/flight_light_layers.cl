/* Adds emission of media to its light layers, whose group follows the groups of all lights. */
#include "film/light_layers.cl"

inline void flight_light_layers(Scene scene, Slab path, uint at, mask flies, integer state, Spectrum light FLIGHT_ARGS)
{
    integer row = scene.settings->light_count;
    light_layers_add(scene, path, at, flies, state & PATH_DEPTH, row, light LIGHT_LAYER_PASSED);
}

/* Twin, where the film has no layers of lights. */
inline void flight_light_layers(Scene scene, Slab path, uint at, mask flies, integer state,
                                Spectrum light FLIGHT_ARGS) {}
