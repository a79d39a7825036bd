/* Ends paths that are finished and begins those that come next: a path that left the scene gathers the infinite
 * lights, a finished path is added to its pixel, and its slot starts the next sample of its work list with a ray
 * from the camera. */
#include "core/base.cl"
#include "interface/stage.cl"
#include "generated/sampler.cl"
#include "interface/camera.cl"
#include "generated/camera.cl"
#include "film/filter.cl"
#include "film/film.cl"
#include "film/work_list.cl"
#include "generated/bands.cl"
#include "interface/shape.cl"
#include "interface/light.cl"
#include "generated/lights.cl"
#include "generated/medium.cl"
#include "path/path_end.cl"

/* The radiance of the paths, with what those that left the scene gather there. */
inline Spectrum path_radiance(Scene scene, Slab path, At at, PathEnd end, Wavelengths lambdas)
{
    Spectrum radiance = load_path_radiance(path, at);
#if USES_INFINITE
    mask sky = end.missed & ((end.depth > 0) | mask_of(scene.settings->hide_lights + scene.settings->alpha == 0));
    if (any(sky)) {
        real pdf = load_path_pdf(path, at);
        vec3 d = sel3(sky, load_path_d(path, at), v3(0.0f, 0.0f, 1.0f)); /* a slot without a pixel has none */
        Spectrum arrives = infinite_gather(scene, load_path_sampled_hemisphere(path, at), d, pdf, lambdas);
#if USES_ABSORPTION
        integer medium = sel_i(sky, load_path_medium(path, at), (integer)(0));
        arrives = spectrum_mul(arrives, medium_transmittance(scene, medium, (real)(FAR), lambdas));
#endif
        radiance = spectrum_sel(sky, spectrum_add(radiance, spectrum_mul(load_path_beta(path, at), arrives)), radiance);
    }
#endif
    return radiance;
}

/* What the slots have summed of their pixels, with the finished paths added. What is not finite counts as black, at
 * its own wavelength. */
inline Exposure add_sample(Scene scene, Slab path, At at, BEGIN_ARGS, PathEnd end, integer slot, integer pixel_index,
                           integer sample)
{
    Wavelengths lambdas = load_path_lambdas(path, at);
    Spectrum radiance = path_radiance(scene, path, at, end, lambdas);
    mask finished = end.ended & end.begun, finite = mask_of(1);
#define C(c)                                              \
    finite = finite & (fabs(radiance.c) < FIXED_LARGEST); \
    radiance.c = sel(fabs(radiance.c) < FIXED_LARGEST, radiance.c, (real)(0.0f));
    SPECTRUM_EACH(C)
#undef C
#if USES_FLUORESCENCE /* the film sees the camera's wavelengths, not those by which the light came */
    Sampler begun_with = pixel_sampler(scene.settings, load_path_pixel_key(path, at), sample);
    lambdas = wavelengths_sample(scene, sampler_pair(begun_with, (natural)(DIMENSION_WAVELENGTH)).x);
#endif
    real weight = load_path_weight(path, at);
    vec3 value = scale3(film_value(scene, radiance, lambdas), weight);
    mask accepted = finished & film_accepts(value);
    Exposure before = {load_path_first(path, at), load_path_second(path, at), load_path_third(path, at),
                       load_path_samples(path, at)};
#if USES_ALPHA
    mask covers = finished & !(end.missed & (end.depth == 0));
    before.covered = fixed_add(load_path_covered(path, at), fixed_of(sel(covers, weight, (real)(0.0f))));
#endif
    Exposure e = exposure_add(before, sel3(accepted, value, v3(0.0f, 0.0f, 0.0f)));
    integer full = sel_i(exposure_is_full(e), (integer)(1), (integer)(0));
#if USES_BANDS
    full += bands_add(scene, bands, accepted, divide(slot, scene.settings->per_plane), pixel_index, radiance, lambdas,
                      weight);
#endif
    path_end_count(counters, end, end.depth + path_nulls(path, at));
    count(counters, COUNTER_REJECTED, finished & !(accepted & finite), (integer)(1));
    count(counters, COUNTER_FULL, finished & (full > 0), full);
    return e;
}

/* Where a slot leaves a pixel, the film takes what was summed of it. */
inline Exposure change_pixel(Scene scene, global uint *film, global uint *counters, PathEnd end, NextSample next,
                             integer pixel_index, Exposure e)
{
    if (any(next.leaves)) {
        mask leaves = next.leaves & end.begun;
        integer full = film_add(scene.settings, film, leaves, next.plane, pixel_index, e);
        count(counters, COUNTER_FULL, leaves & (full > 0), full);
        e = exposure_sel(next.leaves, exposure_none(), e);
    }
    return e;
}

/* Puts a ray from the camera into the slots that `go` on. */
inline void begin_path(Scene scene, Slab path, At at, mask go, integer pixel_index, integer sample)
{
    global const Settings *settings = scene.settings;
    vec2 pixel = pixel_of_index(settings, pixel_index);
    natural key = pixel_key(settings, pixel_index);
    Sampler sampler = pixel_sampler(settings, key, sample);
    vec2 offset = {0.0f, 0.0f};
    real weight = 1.0f, nothing = 0.0f;
#if CHANNEL_IS_ID /* which has no mean over a filter */
    nothing = -1.0f;
#else
    filter_sample(scene, sampler_pair(sampler, (natural)(DIMENSION_FILM)), &offset, &weight);
#endif
    vec2 position = film_position(settings, pixel, offset);
    Wavelengths lambdas = wavelengths_sample(scene, sampler_pair(sampler, (natural)(DIMENSION_WAVELENGTH)).x);
    CameraRay ray = camera_ray(scene, position, sampler_pair(sampler, (natural)(DIMENSION_LENS)), lambdas);
    store_path_pixel_key(path, at, go, key);
    store_path_weight(path, at, go, weight);
    store_path_o(path, at, go, ray.o);
    store_path_d(path, at, go, ray.d);
    store_path_lambdas(path, at, go, lambdas);
    store_path_beta(path, at, go, camera_start());
    store_path_radiance(path, at, go, spectrum_of(nothing));
    store_path_pdf(path, at, go, -ray.far);
    store_path_eta(path, at, go, (real)(1.0f));
#if USES_NULL_SURFACES
    store_path_nulls(path, at, go, (integer)(0));
    store_path_null_distance(path, at, go, (real)(0.0f));
#endif
#if USES_ABSORPTION
    store_path_medium(path, at, go, (integer)(0));
    store_path_lead(path, at, go, (real)(0.0f));
#endif
#if USES_DISPERSION
    store_path_ratio(path, at, go, camera_start());
#endif
}

STAGE(generate)(SLAB_ARGS, SCENE_ARGS, BEGIN_ARGS STAGE_AT_ARG)
{
    SLABS
    SCENE
    STAGE_AT
    PathEnd end = path_end(path, hit, at);
    if (any(end.ended)) {
        integer slot = LANE_INDEX + (int)at;
        integer pixel_index = load_path_pixel_index(path, at), sample = load_path_sample(path, at);
        Exposure e = add_sample(scene, path, at, BEGIN_PASSED, end, slot, pixel_index, sample);
        NextSample next = next_sample(settings, work_list, samples, slot, end.ended, end.begun, pixel_index, sample);
        e = change_pixel(scene, film, counters, end, next, pixel_index, e);
        count(counters, COUNTER_DONE, next.done, (integer)(1));
        mask go = end.ended & !next.done;
        store_path_pixel_index(path, at, next.leaves & go, next.pixel_index);
        store_path_sample(path, at, go, next.sample);
        store_path_first(path, at, go, e.first);
        store_path_second(path, at, go, e.second);
        store_path_third(path, at, go, e.third);
        store_path_samples(path, at, go, e.samples);
#if USES_ALPHA
        store_path_covered(path, at, go, e.covered);
#endif
        begin_path(scene, path, at, go, next.pixel_index, next.sample);
        store_path_state(path, at, end.ended, sel_i(next.done, (integer)(PATH_DONE), (integer)(PATH_ALIVE)));
    }
}
