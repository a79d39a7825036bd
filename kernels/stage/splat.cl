/* Tests the rays that wait to reach the camera, and adds what they carry to the pixel that sees them. */
#include "core/base.cl"
#include "interface/shape.cl"
#include "generated/trace.cl"
#include "generated/transmittance.cl"
#include "interface/stage.cl"
#include "film/film.cl"
#include "film/splat.cl"

STAGE(splat)(SLAB_ARGS, SCENE_ARGS, JOIN_ARGS STAGE_AT_ARG)
{
    SLABS
    SCENE
    STAGE_AT
    real t = load_shadow_t(shadow, at);
    mask active = t > 0.0f;
    if (any(active)) {
        vec3 o = load_shadow_o(shadow, at), d = load_shadow_d(shadow, at);
        Wavelengths lambdas = load_path_lambdas(path, at);
        real share = trace_transmittance(TRACE_PASSED, scene, o, d, t, lambdas, active);
        mask open = active & (share > 0.0f);
        vec3 value = film_value(scene, spectrum_scale(load_shadow_value(shadow, at), share), lambdas);
        mask sane = open & (fabs(value.x) + fabs(value.y) + fabs(value.z) < 1e30f); /* false for NaN */
        integer plane = divide(LANE_INDEX + (int)at, settings->per_plane);
        film_splat(settings, film, sane, plane, load_shadow_pixel(shadow, at), value);
        count(counters, COUNTER_REJECTED, open & !sane, (integer)(1));
        store_shadow_t(shadow, at, active, (real)(-1.0f));
    }
}
