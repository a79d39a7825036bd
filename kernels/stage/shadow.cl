/* Tests the rays that wait to reach a light, and adds the part of their light that arrives to their paths' radiance. */
#include "stage/stage.cl"
#include "generated/join_args.cl"
#include "generated/shadow_ray.cl"
#include "generated/light_layers.cl"
#include "generated/optical_length.cl"

STAGE(shadow)(SLAB_ARGS, SCENE_ARGS, JOIN_ARGS STAGE_AT_ARG)
{
    STAGE_BEGIN
    real t = load_shadow_t(shadow, at);
    mask active = t > 0.0f;
    if (any(active)) {
        scene.time = load_path_time(path, at);
        ShadowPassage passes = shadow_ray_transmittance(TRACE_PASSED, scene, path, shadow, at, t, active);
        mask lit = active & (shadow_most(passes) > 0.0f);
        Spectrum value = load_shadow_value(shadow, at), light = shadow_dims(value, passes);
        store_path_radiance(path, at, lit, shadow_adds(value, passes, load_path_radiance(path, at)));
#if LIGHT_LAYERS
        integer surfaces = load_path_state(path, at) & PATH_DEPTH, row = load_path_light(path, at);
        light_layers_add(scene, path, at, lit, surfaces, row, length_of_shadow(shadow, at), light LIGHT_LAYER_PASSED);
#endif
    }
}
