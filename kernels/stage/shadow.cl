/* Tests the rays that wait to reach a light, and adds what they carry where nothing is in the way. */
#include "lib/base.cl"
#include "lib/shape.cl"
#include "generated/trace.cl"
#include "bvh/apart.cl"

kernel APART void shadow(SLAB_ARGS, SCENE_ARGS, TRACE_ARGS)
{
    SLABS
    SCENE
    uint at = get_global_id(0) * LANES;
    real t = load_shadow_t(shadow, at);
    mask active = t > 0.0f;
    if (any(active)) {
        vec3 o = load_shadow_o(shadow, at), d = load_shadow_d(shadow, at);
        mask open = active & !trace_occluded(TRACE, scene, o, d, t, active);
        Spectrum sum = spectrum_add(load_path_radiance(path, at), load_shadow_value(shadow, at));
        store_path_radiance(path, at, open, sum);
        store_shadow_t(shadow, at, active, (real)(-1.0f));
    }
}
