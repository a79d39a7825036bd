/* Adding to pixels that the slot does not own: by compare and swap, as OpenCL 1.2 has no other atomic addition of
 * floats. What rounding takes goes to the pixel's compensation, so the sum is as exact as a slot's own; but its
 * order, and with it the last bits, may differ from run to run. */
#include "film/film.cl"

inline float splat_swap(global float *film, int at, float v, float *before)
{
    volatile global uint *word = (volatile global uint *)(film + at);
    uint seen, now = *word;
    do {
        seen = now;
        now = atomic_cmpxchg(word, seen, as_uint(as_float(seen) + v));
    } while (now != seen);
    *before = as_float(seen);
    return *before + v;
}
inline void splat_one(global float *film, int at, int compensation, float v)
{
    float before, ignored, total = splat_swap(film, at, v, &before);
    float rounded = fabs(before) >= fabs(v) ? (before - total) + v : (v - total) + before;
    if (rounded != 0.0f) splat_swap(film, at + compensation, rounded, &ignored);
}

inline void film_splat(global const Settings *settings, global float *film, mask m, integer plane, integer pixel_index,
                       vec3 v)
{
    int padded_pixels = settings->padded_pixels;
    integer at = plane * FILM_WORDS * padded_pixels + pixel_index;
#define ADD(i)                                                                             \
    if (LANE(m, i)) {                                                                      \
        splat_one(film, LANE(at, i), 3 * padded_pixels, LANE(v.x, i));                     \
        splat_one(film, LANE(at, i) + padded_pixels, 3 * padded_pixels, LANE(v.y, i));     \
        splat_one(film, LANE(at, i) + 2 * padded_pixels, 3 * padded_pixels, LANE(v.z, i)); \
    }
    FOR_LANES(ADD)
#undef ADD
}
