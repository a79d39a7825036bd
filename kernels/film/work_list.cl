/* The next pixel and sample of a slot (clpt/render/wavefront/path_buffers.py).
 *
 * The slots of a film plane share its pixels: each has a list of pixels and renders all samples of the plane in a pixel
 * before it goes to the next. `work_list` holds, `padded_pixels` words each: the pixel after each pixel, the end of
 * each pixel's samples; then the first pixel of each slot of a plane. An index that is not below
 * `padded_pixels` ends a list. The samples of a pixel are dealt out to the planes in turn. */

inline integer slot_plane(global const Settings *settings, integer slot)
{
    if (settings->planes == 1) return (integer)(0);
    return divide(slot, settings->per_plane);
}

/* The part of the film that a sample goes to. A film has a single part, unless even and odd samples are kept apart, or
 * octaves: samples from 2^k to before 2^(k + 1), where even and odd k have a part each. */
inline integer film_part(global const Settings *settings, integer sample)
{
    integer part = sample & (settings->halves - 1);
    if (settings->octaves > 1) part += (clz(sample) & 1) * settings->halves;
    return part;
}

/* The distance from `first` to the first sample of a plane. */
inline integer plane_ahead(integer plane, int planes, int first)
{
    integer ahead = plane - first % planes;
    return sel_i(ahead < 0, ahead + planes, ahead);
}

/* The end of a pixel's samples, `end` at most. */
inline integer work_list_end(global const Settings *settings, global const uint *work_list, integer pixel_index,
                             int end)
{
    return min_i(gather_i(work_list, pixel_index + settings->padded_pixels), (integer)(end));
}

/* The next pixel after `pixel_index`, or for a slot that has not `begun` its first pixel, that wants a sample `ahead`
 * of the first sample. slot: of its plane. */
inline integer work_list_next(global const Settings *settings, global const uint *work_list, mask leaves, mask begun,
                              integer pixel_index, integer slot, integer ahead, int2 samples)
{
    int padded_pixels = settings->padded_pixels;
    integer next = gather_i(work_list, sel_i(begun, pixel_index, slot + 2 * padded_pixels));
    for (;;) {
        mask there = leaves & (next < padded_pixels);
        integer at = sel_i(there, next, (integer)(0));
        mask idle = there & (work_list_end(settings, work_list, at, samples.y) - samples.x <= ahead);
        if (!any(idle)) return next;
        next = sel_i(idle, gather_i(work_list, at), next);
    }
}

typedef struct {
    integer pixel_index, sample; /* the next */
    mask leaves;                 /* the slot leaves its pixel, if it had a pixel */
    mask done;                   /* it leaves, and its list is at its end */
} NextSample;

/* The sample after `sample` of a pixel, in the slots that `ended` a path; for slots that have not `begun`, the first
 * sample. samples: first and end of the samples to render. */
inline NextSample next_sample(global const Settings *settings, global const uint *work_list, int2 samples,
                              integer slot, mask ended, mask begun, integer pixel_index, integer sample)
{
    int planes = settings->planes, per_plane = settings->per_plane;
    integer plane = slot_plane(settings, slot), ahead = plane_ahead(plane, planes, samples.x);
    NextSample n = {pixel_index, sample + planes, (integer)(0), (integer)(0)};
    integer left = work_list_end(settings, work_list, pixel_index, samples.y) - sample; /* sums may leave an int */
    n.leaves = ended & (!begun | (left <= planes));
    if (any(n.leaves)) {
        integer own = slot - plane * per_plane;
        integer next = work_list_next(settings, work_list, n.leaves, begun, pixel_index, own, ahead, samples);
        n.done = n.leaves & (next >= settings->padded_pixels);
        n.pixel_index = sel_i(n.leaves & !n.done, next, pixel_index);
        n.sample = sel_i(n.leaves & !n.done, ahead + samples.x, n.sample);
    }
    return n;
}
