/* Tests the rays that wait to reach the camera, and adds the part of their light that arrives to the pixels whose
 * filters hold its point on the film. No sample is counted here: stage/emit.cl counts paths. */
#include "stage/stage.cl"
#include "generated/join_args.cl"
#include "generated/shadow_ray.cl"
#include "film/filter.cl#spread"
#include "film/work_list.cl"
#include "generated/light_layers.cl"

STAGE(splat)(SLAB_ARGS, SCENE_ARGS, JOIN_ARGS STAGE_AT_ARG)
{
    STAGE_BEGIN
    real t = load_shadow_t(shadow, at);
    mask active = t > 0.0f;
    if (any(active)) {
        scene.time = load_path_time(path, at);
        ShadowPassage passes = shadow_ray_transmittance(TRACE_PASSED, scene, path, shadow, at, t, active);
        mask arrives = active & (shadow_most(passes) > 0.0f);
        Wavelengths lambdas = load_path_lambdas(path, at);
        Spectrum value = shadow_dims(load_shadow_value(shadow, at), passes);
        real scale = settings->film_scale;
        vec3 colour = scale3(film_value(scene, value, lambdas), scale);
        mask accepted = arrives & film_accepts(colour);
        integer part = film_part(settings, load_path_sample(path, at));
        vec2 seen = load_shadow_film(shadow, at);
        seen.x = sel(accepted, seen.x, (real)(0.0f));
        seen.y = sel(accepted, seen.y, (real)(0.0f));
        vec2 offset = {seen.x - floor(seen.x) - 0.5f, seen.y - floor(seen.y) - 0.5f};
        Spread spread = spread_point(scene, to_integer(floor(seen.x)), to_integer(floor(seen.y)), offset);
        Light light = {colour, 0, (real)(1.0f), value, lambdas, scale};
#if LIGHT_LAYERS
        integer surfaces = (load_path_state(path, at) & PATH_DEPTH) - 1, row = load_path_light(path, at);
        for (int i = 0; i < SPREAD_PIXELS; i++) {
            integer pixel_index;
            real f;
            mask there = accepted & spread_pixel(settings, spread, i, &pixel_index, &f);
            light_layers_sum(scene, there, pixel_index, surfaces, row, (real)(0.0f), LIGHT_LAYERS, scale3(colour, f),
                             light_layers);
        }
#endif
        integer full = spread_add(scene, SPREAD_PASSED, accepted, accepted, part, spread, light);
        count(counters, COUNTER_REJECTED, arrives & !accepted, (integer)(1));
        count(counters, COUNTER_FULL, accepted & (full > 0), full);
    }
}
