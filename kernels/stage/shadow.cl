/* Tests the rays that wait to reach a light, and adds to their paths' radiance what arrives of what they carry. */
#include "core/base.cl"
#include "interface/stage.cl"
#include "generated/join_args.cl"
#include "generated/shadow_ray.cl"
#include "generated/light_layers.cl"

STAGE(shadow)(SLAB_ARGS, SCENE_ARGS, JOIN_ARGS STAGE_AT_ARG)
{
    SLABS
    SCENE
    STAGE_AT
    real t = load_shadow_t(shadow, at);
    mask active = t > 0.0f;
    if (any(active)) {
        scene.time = load_path_time(path, at);
#if SHADOW_MEDIA || FREE_PANES
        Spectrum passes = shadow_ray_transmittance(TRACE_PASSED, scene, path, shadow, at, t, active);
        mask lit = active & (spectrum_max(passes) > 0.0f);
        Spectrum light = spectrum_mul(load_shadow_value(shadow, at), passes);
        store_path_radiance(path, at, lit, spectrum_add(light, load_path_radiance(path, at)));
#else
        real transmittance = shadow_ray_transmittance(TRACE_PASSED, scene, path, shadow, at, t, active);
        mask lit = active & (transmittance > 0.0f);
        Spectrum light = spectrum_scale(load_shadow_value(shadow, at), transmittance);
        Spectrum sum = spectrum_madd(load_shadow_value(shadow, at), transmittance, load_path_radiance(path, at));
        store_path_radiance(path, at, lit, sum);
#endif
#if LIGHT_LAYERS
        integer surfaces = load_path_state(path, at) & PATH_DEPTH, row = load_path_light(path, at);
        light_layers_add(scene, path, at, lit, surfaces, row, light, light_layers);
#endif
    }
}
