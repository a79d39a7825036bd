/* The film while it is being exposed: places (pixels in the order of 4x4 tiles), planes, counters.
 * A slot owns its place, so nothing here is atomic but the counters. */
#define FILM_WORDS 7 /* sum and rest of three channels, and how many samples; a stream of `places` per word and plane */

/* The pixel of a place: x and y, whole numbers. */
inline vec2 pixel_of_index(global const Settings *settings, integer pixel_index)
{
    integer tile = pixel_index >> 4, row = divide(tile, settings->tiles_x), column = tile - row * settings->tiles_x;
    vec2 p = {to_real(column * 4 + (pixel_index & 3)), to_real(row * 4 + ((pixel_index >> 2) & 3))};
    return p;
}

/* A point of the whole film, 0 to 1: `offset` [pixels] from the centre of a pixel of the picture. */
inline vec2 film_position(global const Settings *settings, vec2 pixel, vec2 offset)
{
    vec2 p = {(pixel.x + (settings->crop_x + 0.5f) + offset.x) / (float)settings->film_width,
              (pixel.y + (settings->crop_y + 0.5f) + offset.y) / (float)settings->film_height};
    return p;
}

/* The first sample at or after `first` that belongs to a plane. */
inline integer plane_sample(integer plane, int planes, int first)
{
    integer ahead = plane - first % planes;
    return first + sel_i(ahead < 0, ahead + planes, ahead);
}

/* Compensated addition (Neumaier 1974): what rounding takes from the sum is kept in `rest`. */
inline void sum_add(real *sum, real *compensation, real v)
{
    real total = *sum + v;
    *compensation += sel(fabs(*sum) >= fabs(v), (*sum - total) + v, (v - total) + *sum);
    *sum = total;
}

/* A slot's walk. `walk` holds for each place the one after it in its slot's list, then for each place the sample
 * before which it is left, then where the slots of a plane begin; a place outside the film ends a list. */
inline integer work_list_end(global const Settings *settings, global const uint *work_list, integer pixel_index, int end)
{
    return min_i(gather_i(work_list, pixel_index + settings->padded_pixels), (integer)(end));
}

/* The place after `place`, or the first one of a slot that has not `begun`, where a sample from `start` on is wanted. */
inline integer work_list_next(global const Settings *settings, global const uint *work_list, mask turn, mask begun, integer pixel_index,
                         integer index, integer start, int end)
{
    int padded_pixels = settings->padded_pixels;
    integer next = gather_i(work_list, sel_i(begun, pixel_index, index + 2 * padded_pixels));
    for (;;) {
        mask there = turn & (next < padded_pixels);
        integer at = sel_i(there, next, (integer)(0));
        mask idle = there & (start >= work_list_end(settings, work_list, at, end));
        if (!any(idle)) return next;
        next = sel_i(idle, gather_i(work_list, at), next);
    }
}

typedef struct {
    vec3 sum, compensation;
    real samples;
} Exposure;

inline Exposure film_load(global const Settings *settings, global const float *film, mask m, integer plane, integer pixel_index)
{
    integer padded_pixels = settings->padded_pixels, at = plane * FILM_WORDS * padded_pixels + sel_i(m, pixel_index, (integer)(0));
    Exposure e;
    e.sum = v3(gather(film, at), gather(film, at + padded_pixels), gather(film, at + 2 * padded_pixels));
    e.compensation = v3(gather(film, at + 3 * padded_pixels), gather(film, at + 4 * padded_pixels), gather(film, at + 5 * padded_pixels));
    e.samples = gather(film, at + 6 * padded_pixels);
    return e;
}
inline void film_store(global const Settings *settings, global float *film, mask m, integer plane, integer pixel_index, Exposure e)
{
    integer padded_pixels = settings->padded_pixels, at = plane * FILM_WORDS * padded_pixels + pixel_index;
    scatter_if(film, at, m, e.sum.x);
    scatter_if(film, at + padded_pixels, m, e.sum.y);
    scatter_if(film, at + 2 * padded_pixels, m, e.sum.z);
    scatter_if(film, at + 3 * padded_pixels, m, e.compensation.x);
    scatter_if(film, at + 4 * padded_pixels, m, e.compensation.y);
    scatter_if(film, at + 5 * padded_pixels, m, e.compensation.z);
    scatter_if(film, at + 6 * padded_pixels, m, e.samples);
}

/* Counters that the host reads while it enqueues. */
#define COUNTER_DONE 0     /* slots that have walked their list */
#define COUNTER_SAMPLES 1  /* paths put on the film */
#define COUNTER_CLOSEST 2  /* rays of them */
#define COUNTER_SHADOW 3   /* shadow rays of them */
#define COUNTER_REJECTED 4 /* samples that were not finite and count as black */
inline void count(global uint *counters, int which, mask m, integer v)
{
    if (any(m)) atomic_add(&counters[which], (uint)sum_lanes(sel_i(m, v, (integer)(0))));
}
