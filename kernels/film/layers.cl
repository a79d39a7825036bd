/* Layers beside the picture, in memory: sums over the first LAYER_SAMPLES samples of each pixel, so that they cost little;
 * whole numbers, which add in any order. What is summed is in path/layers.cl.
 *
 * `layers` is LAYER_WORDS streams of padded_pixels words: how many samples, then a word for each number that is near 1
 * (in units of 2^-22), and three for others, as film/sums.cl has them. LAYER_<NAME> is the first word of a layer. */
#include "film/sums.cl"
#define LAYER_SAMPLES 64
#define LAYER_UNITS 0x1p22f
#define LAYER_LARGEST 7.9f /* times samples and units it is less than 2^31 */

/* Whether a sample is one of those that layers have. */
inline mask layers_want(Slab path, uint at, mask m) { return m & (load_path_sample(path, at) < LAYER_SAMPLES); }

/* What the pixel filter gives a sample: some have lobes below 0. */
#if FILM_WEIGHTS
#define layer_weight(path, at) ((real)(1.0f))
#else
#define layer_weight(path, at) load_path_weight(path, at)
#endif

/* Counts a sample of each path. */
inline void layers_count(Scene scene, global uint *layers, mask m, integer pixel_index)
{
    const int *at_lane = (const int *)&m, *pixels = (const int *)&pixel_index;
    for (int i = 0; i < LANES; i++)
        if (at_lane[i]) sums_add_word(layers + pixels[i], 1u);
}

/* Adds three numbers that are near 1. */
inline void layer_add(Scene scene, global uint *layers, mask m, integer pixel_index, int word, vec3 v)
{
    size_t stream = scene.settings->padded_pixels;
    global uint *first = layers + word * stream;
    integer x = to_integer(clamp_r(v.x, (real)(-LAYER_LARGEST), (real)(LAYER_LARGEST)) * LAYER_UNITS);
    integer y = to_integer(clamp_r(v.y, (real)(-LAYER_LARGEST), (real)(LAYER_LARGEST)) * LAYER_UNITS);
    integer z = to_integer(clamp_r(v.z, (real)(-LAYER_LARGEST), (real)(LAYER_LARGEST)) * LAYER_UNITS);
    const int *at_lane = (const int *)&m, *pixels = (const int *)&pixel_index;
    const uint *xs = (const uint *)&x, *ys = (const uint *)&y, *zs = (const uint *)&z;
    for (int i = 0; i < LANES; i++) {
        if (!at_lane[i]) continue;
        sums_add_word(first + pixels[i], xs[i]);
        sums_add_word(first + stream + pixels[i], ys[i]);
        sums_add_word(first + 2 * stream + pixels[i], zs[i]);
    }
}

/* Adds a number of any size. */
inline void layer_add_long(Scene scene, global uint *layers, mask m, integer pixel_index, int word, real v)
{
    size_t stream = scene.settings->padded_pixels;
    Fixed f = fixed_of(sel(fabs(v) < FIXED_LARGEST, v, (real)(0.0f)));
    const int *at_lane = (const int *)&m, *pixels = (const int *)&pixel_index;
    const uint *low = (const uint *)&f.low, *middle = (const uint *)&f.middle, *high = (const uint *)&f.high;
    for (int i = 0; i < LANES; i++)
        if (at_lane[i]) sums_add(layers + word * stream + pixels[i], stream, low[i], middle[i], high[i]);
}
