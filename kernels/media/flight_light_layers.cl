/* Adds light of media to the layers of the group that is told behind those of all lights. */
#include "film/light_layers.cl"

inline void flight_light_layers(Scene scene, Slab path, uint at, mask flies, integer state, Spectrum light FLIGHT_ARGS)
{
    integer row = scene.settings->light_count;
    light_layers_add(scene, path, at, flies, state & PATH_DEPTH, row, light LIGHT_LAYER_PASSED);
}

/* Twin, where no layers of light are wanted. */
inline void flight_light_layers(Scene scene, Slab path, uint at, mask flies, integer state, Spectrum light FLIGHT_ARGS)
{
}
