/* Tests the rays that wait to reach the camera, and adds what arrives of what they carry to the pixel that sees it. */
#include "core/base.cl"
#include "interface/stage.cl"
#include "path/shadow_ray.cl"
#include "film/splat.cl"
#include "film/work_list.cl"
#include "generated/bands.cl"

STAGE(splat)(SLAB_ARGS, SCENE_ARGS, JOIN_ARGS STAGE_AT_ARG)
{
    SLABS
    SCENE
    STAGE_AT
    real t = load_shadow_t(shadow, at);
    mask active = t > 0.0f;
    if (any(active)) {
        real transmittance = shadow_ray_transmittance(TRACE_PASSED, scene, path, shadow, at, t, active);
        mask arrives = active & (transmittance > 0.0f);
        Wavelengths lambdas = load_path_lambdas(path, at);
        Spectrum value = spectrum_scale(load_shadow_value(shadow, at), transmittance);
        real scale = settings->film_scale;
        vec3 colour = scale3(film_value(scene, value, lambdas), scale);
        mask accepted = arrives & film_accepts(colour);
        integer plane = slot_plane(settings, LANE_INDEX + (int)at), pixel_index = load_shadow_pixel(shadow, at);
        integer full = film_splat(settings, film, accepted, plane, pixel_index, colour);
#if USES_BANDS
        full += bands_add(scene, bands, accepted, plane, pixel_index, value, lambdas, scale);
#endif
        count(counters, COUNTER_REJECTED, arrives & !accepted, (integer)(1));
        count(counters, COUNTER_FULL, accepted & (full > 0), full);
    }
}
