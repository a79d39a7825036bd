/* The film while it is being exposed. A film is FILM_WORDS streams of `padded_pixels` floats per plane; pixels are
 * stored in 4x4 tiles, row by row in a tile and tile by tile in a row of them. A slot owns the pixel of its plane
 * that it renders, so nothing here is atomic but the counters. */
#define FILM_WORDS 7 /* sums of three channels, their compensations, and the number of samples */

/* Where the pixel (x, y) of the picture is stored. */
inline integer film_pixel_index(global const Settings *settings, integer x, integer y)
{
    return ((y >> 2) * settings->tiles_x + (x >> 2)) * 16 + (y & 3) * 4 + (x & 3);
}

/* The pixel that is stored at an index: x and y, whole numbers. */
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

/* Whether the film takes a value: neither NaN nor so large that sums would overflow. */
inline mask film_accepts(vec3 value) { return fabs(value.x) + fabs(value.y) + fabs(value.z) < 1e30f; }

/* Compensated addition (Neumaier 1974): `compensation` gathers what rounding takes from `sum`. */
inline void sum_add(real *sum, real *compensation, real v)
{
    real total = *sum + v;
    *compensation += sel(fabs(*sum) >= fabs(v), (*sum - total) + v, (v - total) + *sum);
    *sum = total;
}

/* What a pixel of one plane holds. */
typedef struct {
    vec3 sum, compensation;
    real samples;
} Exposure;

inline Exposure film_load(global const Settings *settings, global const float *film, mask m, integer plane,
                          integer pixel_index)
{
    integer stream = settings->padded_pixels, at = plane * FILM_WORDS * stream + sel_i(m, pixel_index, (integer)(0));
    Exposure e;
    e.sum = v3(gather(film, at), gather(film, at + stream), gather(film, at + 2 * stream));
    e.compensation = v3(gather(film, at + 3 * stream), gather(film, at + 4 * stream), gather(film, at + 5 * stream));
    e.samples = gather(film, at + 6 * stream);
    return e;
}

inline void film_store(global const Settings *settings, global float *film, mask m, integer plane, integer pixel_index,
                       Exposure e)
{
    integer stream = settings->padded_pixels, at = plane * FILM_WORDS * stream + pixel_index;
    scatter_if(film, at, m, e.sum.x);
    scatter_if(film, at + stream, m, e.sum.y);
    scatter_if(film, at + 2 * stream, m, e.sum.z);
    scatter_if(film, at + 3 * stream, m, e.compensation.x);
    scatter_if(film, at + 4 * stream, m, e.compensation.y);
    scatter_if(film, at + 5 * stream, m, e.compensation.z);
    scatter_if(film, at + 6 * stream, m, e.samples);
}

/* Sums `words` words of a pixel over the planes, from the first plane on. */
inline void film_sum(global const Settings *settings, global const float *film, int pixel_index, int first, int words,
                     float *sums)
{
    int stream = settings->padded_pixels;
    for (int i = 0; i < words; i++) sums[i] = 0.0f;
    for (int plane = 0; plane < settings->planes; plane++)
        for (int i = 0; i < words; i++) sums[i] += film[(plane * FILM_WORDS + first + i) * stream + pixel_index];
}

/* Counters that the host reads while it enqueues. */
#define COUNTER_DONE 0     /* slots that have come to the end of their work list */
#define COUNTER_SAMPLES 1  /* paths put on the film */
#define COUNTER_CLOSEST 2  /* rays of them */
#define COUNTER_SHADOW 3   /* shadow rays of them */
#define COUNTER_REJECTED 4 /* samples that were not finite and count as black */
inline void count(global uint *counters, int which, mask m, integer v)
{
    if (any(m)) atomic_add(&counters[which], (uint)sum_lanes(sel_i(m, v, (integer)(0))));
}
