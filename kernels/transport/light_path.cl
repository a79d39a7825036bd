/* Steps of light paths. */

/* Step. */
#include "transport/light_path.cl#sampler"

/* Stores where the ray from a point, or from infinity, to the camera runs, in the lanes `kept`; returns its length. */
inline real connect_camera(Slab shadow, uint at, mask kept, Surface s, CameraPoint c)
{
    real t = shadow_aim(shadow, at, kept, s, neg3(c.d), c.t);
    mask away = kept & (c.t >= FAR);
    if (any(away)) {
        store_shadow_o(shadow, at, away, c.o);
        store_shadow_d(shadow, at, away, c.d);
    }
    store_shadow_film(shadow, at, kept, c.film);
    return t;
}

/* Step sampler: the random numbers of paths from lights. */
#include "film/pixel.cl"
#define LIGHT_PATH_SEED 0x5bd1e995u /* decorrelates light paths from camera paths */

#if USES_GUIDE
/* The number of a light path that trains a guide: the first numbers do not depend on the film. */
inline integer light_path_number(global const Settings *settings, integer pixel_index, integer sample)
{
    integer x, y;
    pixel_place(settings, pixel_index, &x, &y);
    int width = settings->width + 2 * settings->margin, height = settings->height + 2 * settings->margin;
    return (sample * height + y + settings->margin) * width + x + settings->margin;
}
#endif

/* The sampler of a light path. Its "pixel" only numbers paths: the light paths of a sample are the points of a single
 * sequence, so that they are distributed evenly over the lights. */
inline Sampler light_path_sampler(global const Settings *settings, integer pixel_index, integer sample)
{
#if USES_GUIDE
    natural number = as_natural(light_path_number(settings, pixel_index, sample));
    return sampler_start(settings->seed ^ LIGHT_PATH_SEED, (natural)(0u), number);
#else
    return sampler_start(settings->seed ^ LIGHT_PATH_SEED, as_natural(sample), as_natural(pixel_index));
#endif
}

/* Step next: gives slots their next light path, for stage/emit.cl and stage/flare.cl. */
#include "generated/begin_args.cl"
#include "film/film.cl"
#include "film/work_list.cl"
#include "transport/path_state.cl#end"

/* Counts the light paths that have ended, and gives their slots the next paths of the work list. */
inline NextSample next_light_path(Scene scene, Slab path, uint at, BEGIN_ARGS, PathEnd end)
{
    global const Settings *settings = scene.settings;
    integer slot = LANE_INDEX + (int)at;
    integer pixel_index = load_path_pixel_index(path, at), sample = load_path_sample(path, at);
#if !USES_GUIDE /* light paths that train a guide add nothing to the film */
    path_end_count(counters, end, end.depth - 1 + load_path_nulls(path, at));
    film_count(settings, film, end.ended & end.begun, film_part(settings, sample),
               film_nearest_index(settings, pixel_index));
#endif
    NextSample next = next_sample(settings, work_list, samples, slot, end.ended, end.begun, pixel_index, sample);
    count(counters, COUNTER_DONE, next.done, (integer)(1));
    mask go = end.ended & !next.done;
    store_path_pixel_index(path, at, go, next.pixel_index);
    store_path_pixel_key(path, at, go, as_natural(next.pixel_index));
    store_path_sample(path, at, go, next.sample);
    return next;
}

/* Step endless: a light path with MOST_NULL_COLLISIONS in a single flight counts as rejected, as a camera path does:
 * its flight has stored an infinite radiance (media/flight.cl). */
inline void light_path_endless(Slab path, uint at, PathEnd end, global uint *counters)
{
    mask endless = end.ended & end.begun & (spectrum_max(load_path_radiance(path, at)) > 1e30f);
    count(counters, COUNTER_REJECTED, endless, (integer)(1));
}

/* Resets the radiance of light paths that begin. */
#define light_path_begins(path, at, go) store_path_radiance(path, at, go, spectrum_of(0.0f))

/* Twin, where there are no grids. */
#define light_path_endless(path, at, end, counters)
#define light_path_begins(path, at, go)
