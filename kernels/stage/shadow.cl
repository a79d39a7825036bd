/* Tests the rays that wait to reach a light, and adds what arrives of what they carry. */
#include "core/base.cl"
#include "interface/shape.cl"
#include "generated/trace.cl"
#include "generated/transmittance.cl"
#include "interface/stage.cl"

STAGE(shadow)(SLAB_ARGS, SCENE_ARGS, JOIN_ARGS STAGE_AT_ARG)
{
    SLABS
    SCENE
    STAGE_AT
    real t = load_shadow_t(shadow, at);
    mask active = t > 0.0f;
    if (any(active)) {
        vec3 o = load_shadow_o(shadow, at), d = load_shadow_d(shadow, at);
        real share = trace_transmittance(TRACE_PASSED, scene, o, d, t, load_path_lambdas(path, at), active);
        Spectrum sum = spectrum_madd(load_shadow_value(shadow, at), share, load_path_radiance(path, at));
        store_path_radiance(path, at, active & (share > 0.0f), sum);
        store_shadow_t(shadow, at, active, (real)(-1.0f));
    }
}
