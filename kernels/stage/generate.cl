/* Ends paths that are finished and begins those that come next: a path that left the scene gathers the infinite
 * lights, a finished path is added to its pixel, and its slot starts the next sample of its work list with a ray
 * from the camera. */
#include "stage/stage.cl"
#include "generated/begin_args.cl"
#include "generated/sampler.cl"
#include "cameras/camera.cl"
#include "generated/camera.cl"
#include "film/work_list.cl"
#include "generated/motion.cl"
#include "generated/exposure.cl"
#include "shapes/shape.cl"
#include "lights/light.cl"
#include "generated/lights.cl"
#include "generated/medium.cl"
#include "generated/merging.cl"
#include "transport/path_state.cl#end"
#include "generated/seen_wavelengths.cl"
#include "generated/ghosts.cl"
#include "generated/sky.cl"
#include "generated/path_covers.cl"
#include "generated/first_ray.cl"
#include "generated/first_cone.cl"
#include "generated/layer_sums.cl"
#include "generated/scouts_begin.cl"
#include "generated/row_delay.cl"
#include "generated/optical_length.cl"
#include "generated/reuse.cl"

/* The beginning of a sample. */
typedef struct {
    CameraRay ray;
    Spectrum beta;
    Wavelengths lambdas;
    real time;
    vec2 position, lens;
} SampleBegin;

/* Draws it; `go`: the paths that take it. */
inline SampleBegin sample_begin(Scene scene, Slab path, uint at, mask go, integer pixel_index, integer sample)
{
    global const Settings *settings = scene.settings;
    vec2 pixel = pixel_of_index(settings, pixel_index);
    Sampler sampler = pixel_sampler(settings, pixel_key(settings, pixel_index), sample);
    vec2 offset = exposure_begin(scene, path, at, go, sampler);
    vec2 u = sampler_pair(reuse_sampler(scene, path, at, sampler, sample), (natural)(DIMENSION_WAVELENGTH));
    SampleBegin b;
    b.position = film_position(settings, pixel, offset);
    b.time = motion_time(scene, merging_moment(scene, u.x, u.y, sample)) + row_delay(scene, b.position);
    b.lambdas = wavelengths_sample(scene, merging_wavelength(scene, u.x, sample));
    b.lens = sampler_pair(sampler, (natural)(DIMENSION_LENS));
    scene.time = b.time;
    b.ray = first_ray(scene, b.position, b.lens, b.lambdas, &b.beta);
    return b;
}

#include "generated/path_start.cl"

/* Adds the finished paths to the sums of their pixels. What is not finite counts as black, at its own wavelength. */
inline void add_sample(Scene scene, Slab path, uint at, BEGIN_ARGS, PathEnd end, integer part, integer pixel_index,
                       integer sample)
{
    Spectrum radiance = reuse_gather(path, at, end.ended, sky_gather(scene, path, at, end));
    Wavelengths lambdas = load_path_lambdas(path, at);
    sky_layers(scene, path, at, end, lambdas LIGHT_LAYER_PASSED);
    lambdas = seen_wavelengths(scene, path, at, lambdas);
    mask finished = end.ended & end.begun;
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
    Spectrum start = path_start(scene, path, at, pixel_index, sample);
    real covers = path_covers(scene, path, at, end, lambdas, start);
    Light light = {value, small, covers, radiance, lambdas, scale};
    exposure_add(scene, path, at, BEGIN_PASSED, finished, part, pixel_index, sample, light);
    path_end_count(counters, end, end.depth + load_path_nulls(path, at));
}

/* Puts a ray from the camera into the slots that `go` on. */
inline void begin_path(Scene scene, Slab path, uint at, mask go, integer pixel_index, integer sample)
{
    global const Settings *settings = scene.settings;
    SampleBegin b = sample_begin(scene, path, at, go, pixel_index, sample);
    scene.time = b.time;
    store_path_time(path, at, go, b.time);
    store_path_cone(path, at, go, first_cone(scene, b.ray, b.position, b.lens, b.lambdas));
    store_path_o(path, at, go, b.ray.o);
    store_path_d(path, at, go, b.ray.d);
    store_path_lambdas(path, at, go, b.lambdas);
    store_path_beta(path, at, go, b.beta);
    store_path_radiance(path, at, go, spectrum_of((real)(0.0f)));
    store_path_pdf(path, at, go, -b.ray.far); /* a camera ray has no pdf; stage/intersect.cl reads its range */
    store_path_eta(path, at, go, (real)(1.0f));
    store_path_mis_ratio(path, at, go, (real)(settings->light_paths));
    store_path_expected(path, at, go, (real)(0.0f));
    store_path_merge_ratio(path, at, go, (real)(0.0f));
    store_path_nulls(path, at, go, (integer)(0));
    store_path_null_distance(path, at, go, (real)(0.0f));
    store_path_medium(path, at, go, (integer)(settings->camera_medium));
    store_path_around(path, at, go, (integer)(settings->camera_around));
    store_path_ray_offset(path, at, go, (real)(0.0f));
    store_path_escape_width(path, at, go, (real)(0.0f));
    store_path_bodies(path, at, go, (integer)(settings->camera_bodies));
    store_path_ratio(path, at, go, camera_start());
    length_begin(scene, path, at, go, b.ray.far);
}

STAGE(generate)(SLAB_ARGS, SCENE_ARGS, BEGIN_ARGS STAGE_AT_ARG)
{
    STAGE_BEGIN
    scene.time = load_path_time(path, at);
    PathEnd end = reuse_end(path_end(path, hit, at));
    if (sky_due(end)) {
        integer slot = LANE_INDEX + (int)at;
        integer pixel_index = load_path_pixel_index(path, at), sample = load_path_sample(path, at);
        integer part = film_part(settings, sample);
        mask scouted = scouts_ended(end), unseen = layers_end(end, scouted) & (end.depth == 0);
        layers_count(scene, path, at, unseen LAYER_PASSED);
        layers_of_sky(scene, path, at, unseen LAYER_PASSED);
        mask begins = end.ended;
        end.ended = end.ended & !scouted;
        end.missed = end.missed & !scouted;
        add_sample(scene, path, at, BEGIN_PASSED, end, part, pixel_index, sample);
        NextSample next = next_sample(settings, work_list, samples, slot, end.ended, end.begun, pixel_index, sample);
        mask turns = end.ended & !next.leaves & (film_part(settings, next.sample) != part);
        if (any(next.leaves | turns)) {
            mask leaves = next.leaves & end.begun, enters = next.leaves & !next.done;
            exposure_leave(scene, path, at, BEGIN_PASSED, leaves | turns, enters | turns, part, pixel_index);
            store_path_pixel_index(path, at, enters, next.pixel_index);
            store_path_pixel_key(path, at, enters, pixel_key(settings, next.pixel_index));
        }
        count(counters, COUNTER_DONE, next.done, (integer)(1));
        mask go = end.ended & !next.done;
        store_path_sample(path, at, go, next.sample);
        next.sample = sel_i(scouted, sample, next.sample);
        begin_path(scene, path, at, go | scouted, next.pixel_index, next.sample);
        integer begun = PATH_BEGUN | ghost_bit(scene, next.pixel_index, next.sample);
        begun |= scouts_begin(scouted, next.sample);
        store_path_state(path, at, begins, sel_i(next.done, (integer)(PATH_DONE), begun));
        store_path_reuse(path, at, begins, (integer)(0)); /* a slot without a path has nothing to share */
    }
}
