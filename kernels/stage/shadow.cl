/* Tests the rays that wait to reach a light, and adds to their paths' radiance what arrives of what they carry. */
#include "core/base.cl"
#include "interface/stage.cl"
#include "generated/join_args.cl"
#include "path/shadow_ray.cl"

STAGE(shadow)(SLAB_ARGS, SCENE_ARGS, JOIN_ARGS STAGE_AT_ARG)
{
    SLABS
    SCENE
    STAGE_AT
    real t = load_shadow_t(shadow, at);
    mask active = t > 0.0f;
    if (any(active)) {
        real transmittance = shadow_ray_transmittance(TRACE_PASSED, scene, path, shadow, at, t, active);
        Spectrum sum = spectrum_madd(load_shadow_value(shadow, at), transmittance, load_path_radiance(path, at));
        store_path_radiance(path, at, active & (transmittance > 0.0f), sum);
    }
}
