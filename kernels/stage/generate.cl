/* Ends paths that are finished and begins those that come next: a path that left the scene gathers the infinite
 * lights, a finished path is added to its pixel, and its slot starts the next sample of its work list with a ray
 * from the camera. */
#include "core/base.cl"
#include "interface/stage.cl"
#include "generated/begin_args.cl"
#include "generated/sampler.cl"
#include "interface/camera.cl"
#include "generated/camera.cl"
#include "film/work_list.cl"
#include "generated/motion.cl"
#include "generated/exposure.cl"
#include "interface/shape.cl"
#include "interface/light.cl"
#include "generated/lights.cl"
#include "generated/medium.cl"
#include "generated/merging.cl"
#include "path/cone.cl"
#include "path/path_end.cl"
#include "path/met_light.cl"
#include "generated/layer_sums.cl"
#include "generated/light_layers.cl"

/* The radiance of the paths, with what those that left the scene gather there. */
inline Spectrum path_radiance(Scene scene, Slab path, uint at, PathEnd end, Wavelengths lambdas)
{
    Spectrum radiance = load_path_radiance(path, at);
#if USES_INFINITE
    mask sky = end.missed & ((end.depth > 0) | mask_of(scene.settings->hide_lights + scene.settings->alpha == 0));
#if LIT_GHOSTS /* which light paths bring, see stage/flare.cl */
    sky = sky & !((end.depth == 0) & ((end.state & PATH_GHOST) != 0));
#endif
    if (any(sky)) {
        real pdf = load_path_pdf(path, at);
        vec3 d = sel3(sky, load_path_d(path, at), v3(0.0f, 0.0f, 1.0f)); /* a slot without a pixel has none */
        vec3 from = madd3(d, -path_null_distance(path, at), load_path_o(path, at)), side = path_hemisphere(path, at);
        real rival = path_rival(path, at, end.depth);
        Spectrum arrives = infinite_gather(scene, from, side, d, pdf, rival, lambdas);
#if USES_ABSORPTION
        integer medium = sel_i(sky, MEDIUM_LEFT(load_path_medium(path, at)), (integer)(0));
        arrives = spectrum_mul(arrives, medium_transmittance(scene, medium, (real)(FAR), lambdas));
#endif
        radiance = spectrum_sel(sky, spectrum_add(radiance, spectrum_mul(load_path_beta(path, at), arrives)), radiance);
    }
#endif
    return radiance;
}

#if LIGHT_LAYERS && USES_INFINITE
/* Adds what paths gather that left the scene to layers of light, light by light. */
inline void sky_layers(Scene scene, Slab path, uint at, PathEnd end, Wavelengths lambdas, global uint *light_layers)
{
    mask sky = end.missed & ((end.depth > 0) | mask_of(scene.settings->hide_lights + scene.settings->alpha == 0));
    if (!any(sky)) return;
    real pdf = load_path_pdf(path, at);
    vec3 d = sel3(sky, load_path_d(path, at), v3(0.0f, 0.0f, 1.0f));
    vec3 from = madd3(d, -path_null_distance(path, at), load_path_o(path, at)), side = path_hemisphere(path, at);
    real rival = path_rival(path, at, end.depth);
    Spectrum beta = load_path_beta(path, at);
#if USES_ABSORPTION
    integer medium = sel_i(sky, MEDIUM_LEFT(load_path_medium(path, at)), (integer)(0));
    beta = spectrum_mul(beta, medium_transmittance(scene, medium, (real)(FAR), lambdas));
#endif
    for (int row = 0; row < scene.settings->infinite_count; row++) {
        Spectrum light = spectrum_mul(beta, infinite_weighed(scene, row, from, side, d, pdf, rival, lambdas));
        light_layers_add(scene, path, at, sky, end.depth, (integer)(row), light, light_layers);
    }
}
#endif

/* Adds the finished paths to the sums of their pixels. What is not finite counts as black, at its own wavelength. */
inline void add_sample(Scene scene, Slab path, uint at, BEGIN_ARGS, PathEnd end, integer slot, integer pixel_index,
                       integer sample)
{
    Wavelengths lambdas = load_path_lambdas(path, at);
    Spectrum radiance = path_radiance(scene, path, at, end, lambdas);
    mask finished = end.ended & end.begun;
#if LIGHT_LAYERS && USES_INFINITE
    sky_layers(scene, path, at, end, lambdas, light_layers);
#endif
#if USES_FLUORESCENCE /* the film sees the camera's wavelengths, not those by which the light came */
    Sampler begun_with = pixel_sampler(scene.settings, load_path_pixel_key(path, at), sample);
    lambdas = wavelengths_sample(scene, sampler_pair(begun_with, (natural)(DIMENSION_WAVELENGTH)).x);
#endif
    real scale = exposure_weight(path, at) * scene.settings->film_scale;
    vec3 value = scale3(film_value(scene, radiance, lambdas), scale);
    int small = !any(finished & !fixed_takes_small(value));
    if (!small) {
        mask rejected = finished & !film_accepts(value);
        count(counters, COUNTER_REJECTED, rejected, (integer)(1));
#define C(c) \
    radiance.c = sel(fabs(radiance.c) * scene.settings->film_scale < FIXED_LARGEST, radiance.c, (real)(0.0f));
        SPECTRUM_EACH(C)
#undef C
        value = scale3(film_value(scene, radiance, lambdas), scale);
        rejected = finished & !film_accepts(value);
        value = sel3(rejected, v3(0.0f, 0.0f, 0.0f), value);
    }
    Light light = {value, small, !(end.missed & (end.depth == 0)), radiance, lambdas, scale};
    exposure_add(scene, path, at, BEGIN_PASSED, finished, slot_plane(scene.settings, slot), pixel_index, sample, light);
    path_end_count(counters, end, end.depth + path_nulls(path, at));
}

/* Puts a ray from the camera into the slots that `go` on. */
inline void begin_path(Scene scene, Slab path, uint at, mask go, integer pixel_index, integer sample)
{
    global const Settings *settings = scene.settings;
    vec2 pixel = pixel_of_index(settings, pixel_index);
    natural key = pixel_key(settings, pixel_index);
    Sampler sampler = pixel_sampler(settings, key, sample);
    vec2 offset = exposure_begin(scene, path, at, go, sampler);
    vec2 position = film_position(settings, pixel, offset);
    real u = sampler_pair(sampler, (natural)(DIMENSION_WAVELENGTH)).x;
#if USES_MOTION
    real moment = sampler_pair(sampler, (natural)(DIMENSION_WAVELENGTH)).y;
#if MERGES
    moment = merging_moment(scene, u, sample);
#endif
    scene.time = motion_time(scene, moment);
    store_path_time(path, at, go, scene.time);
#endif
#if MERGES
    u = merging_wavelength(scene, u, sample);
#endif
    Wavelengths lambdas = wavelengths_sample(scene, u);
    vec2 lens = sampler_pair(sampler, (natural)(DIMENSION_LENS));
#if CAMERA_WEIGHS
    Spectrum weight;
    CameraRay ray = camera_weighted_ray(scene, position, lens, lambdas, &weight);
    Spectrum beta = spectrum_mul(camera_start(), weight);
#else
    CameraRay ray = camera_ray(scene, position, lens, lambdas);
    Spectrum beta = camera_start();
#endif
#if USES_MIPS
    vec2 beside = {position.x + 1.0f / to_real((integer)(settings->film_width)),
                   position.y + 1.0f / to_real((integer)(settings->film_height))};
#if CAMERA_WEIGHS
    Spectrum unused;
    CameraRay other = camera_weighted_ray(scene, beside, lens, lambdas, &unused);
#else
    CameraRay other = camera_ray(scene, beside, lens, lambdas);
#endif
    store_path_cone(path, at, go, cone_word(cone_of_pixel(ray.o, ray.d, other.o, other.d)));
#endif
    store_path_o(path, at, go, ray.o);
    store_path_d(path, at, go, ray.d);
    store_path_lambdas(path, at, go, lambdas);
    store_path_beta(path, at, go, beta);
    store_path_radiance(path, at, go, spectrum_of((real)(0.0f)));
    store_path_pdf(path, at, go, -ray.far);
    store_path_eta(path, at, go, (real)(1.0f));
#if WEIGHS_LIGHT_PATHS
    store_path_rival(path, at, go, (real)(settings->light_paths));
#endif
#if USES_GUIDE
    store_path_expected(path, at, go, (real)(0.0f));
#endif
#if MERGES
    store_path_pending(path, at, go, (real)(0.0f));
#endif
#if USES_NULL_SURFACES
    store_path_nulls(path, at, go, (integer)(0));
    store_path_null_distance(path, at, go, (real)(0.0f));
#endif
#if USES_ABSORPTION
    store_path_medium(path, at, go, (integer)(settings->camera_medium));
    store_path_lead(path, at, go, (real)(0.0f));
#if USES_BODIES
    store_path_bodies(path, at, go, (integer)(settings->camera_bodies));
#endif
#endif
#if USES_RATIO
    store_path_ratio(path, at, go, camera_start());
#endif
}

#if LIT_GHOSTS
/* Whether a sample follows light that surfaces of the lens have reflected, as camera/lens.cl chooses. */
inline mask begins_ghost(Scene scene, integer pixel_index, integer sample)
{
    Sampler sampler = pixel_sampler(scene.settings, pixel_key(scene.settings, pixel_index), sample);
    return sampler_pair(sampler, (natural)(DIMENSION_LENS)).x < ((global const LensCamera *)scene.camera)->ghosts;
}
#endif

STAGE(generate)(SLAB_ARGS, SCENE_ARGS, BEGIN_ARGS STAGE_AT_ARG)
{
    SLABS
    SCENE
    STAGE_AT
#if USES_MOTION
    scene.time = load_path_time(path, at);
#endif
    PathEnd end = path_end(path, hit, at);
#if USES_INFINITE /* light from all around is gathered here */
    int due = path_end_of_half(end);
#else
    int due = any(end.ended);
#endif
    if (due) {
        integer slot = LANE_INDEX + (int)at;
        integer pixel_index = load_path_pixel_index(path, at), sample = load_path_sample(path, at);
        add_sample(scene, path, at, BEGIN_PASSED, end, slot, pixel_index, sample);
#if USES_LAYERS
        mask unseen = end.ended & end.begun & (end.depth == 0);
        layers_count(scene, path, at, layers, unseen);
#if SCREEN_MOTION
        layers_of_sky(scene, path, at, layers, unseen);
#endif
#endif
        NextSample next = next_sample(settings, work_list, samples, slot, end.ended, end.begun, pixel_index, sample);
        if (any(next.leaves)) {
            mask leaves = next.leaves & end.begun, enters = next.leaves & !next.done;
            exposure_leave(scene, path, at, BEGIN_PASSED, leaves, enters, next.plane, pixel_index);
            store_path_pixel_index(path, at, enters, next.pixel_index);
            store_path_pixel_key(path, at, enters, pixel_key(settings, next.pixel_index));
        }
        count(counters, COUNTER_DONE, next.done, (integer)(1));
        mask go = end.ended & !next.done;
        store_path_sample(path, at, go, next.sample);
        begin_path(scene, path, at, go, next.pixel_index, next.sample);
#if MERGES
        integer begun = PATH_ALIVE | PATH_SHARP;
#else
        integer begun = PATH_ALIVE;
#endif
#if LIT_GHOSTS
        integer first = begun | sel_i(begins_ghost(scene, next.pixel_index, next.sample), (integer)(PATH_GHOST),
                                      (integer)(0));
        store_path_state(path, at, end.ended, sel_i(next.done, (integer)(PATH_DONE), first));
#else
        store_path_state(path, at, end.ended, sel_i(next.done, (integer)(PATH_DONE), begun));
#endif
    }
}
