/* How slots get their next light path, for the stages that begin such (stage/emit.cl, stage/flare.cl). */
#include "generated/begin_args.cl"
#include "film/film.cl"
#include "film/work_list.cl"
#include "transport/path_end.cl"

/* Counts the light paths that have ended, and gives their slots the next ones of the work list. */
inline NextSample next_light_path(Scene scene, Slab path, uint at, BEGIN_ARGS, PathEnd end)
{
    global const Settings *settings = scene.settings;
    integer slot = LANE_INDEX + (int)at;
    integer pixel_index = load_path_pixel_index(path, at), sample = load_path_sample(path, at);
#if !USES_GUIDE /* whose paths leave nothing on the film */
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
