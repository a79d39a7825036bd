/* Layers beside the picture, in memory: sums over the first LAYER_SAMPLES samples of each pixel, so that they cost
 * little; whole numbers, which add in any order. What is summed is in path/layers.cl.
 *
 * `layers` is a stream of padded_pixels words for each of these: how many samples; a word for each number that is
 * near 1, in units of 2^-22; three for others, in units of 2^8, 2^-16 and 2^-40, the lower ones below 2^24. No word
 * leaves its 32 bits, so words add without a carry. LAYER_<NAME> is the first word of a layer. */
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

/* Adds a whole number to each of three neighbouring words. */
inline void layer_add_words(global uint *first, size_t stream, mask m, integer pixel_index, vec3 v)
{
    integer x = to_integer(v.x), y = to_integer(v.y), z = to_integer(v.z);
    const int *at_lane = (const int *)&m, *pixels = (const int *)&pixel_index;
    const uint *xs = (const uint *)&x, *ys = (const uint *)&y, *zs = (const uint *)&z;
    for (int i = 0; i < LANES; i++) {
        if (!at_lane[i]) continue;
        sums_add_word(first + pixels[i], xs[i]);
        sums_add_word(first + stream + pixels[i], ys[i]);
        sums_add_word(first + 2 * stream + pixels[i], zs[i]);
    }
}

/* Adds three numbers that are near 1. */
inline void layer_add(Scene scene, global uint *layers, mask m, integer pixel_index, int word, vec3 v)
{
    size_t stream = scene.settings->padded_pixels;
    vec3 low = v3(-LAYER_LARGEST, -LAYER_LARGEST, -LAYER_LARGEST), high = scale3(low, -1.0f);
    v = v3(clamp_r(v.x, low.x, high.x), clamp_r(v.y, low.y, high.y), clamp_r(v.z, low.z, high.z));
    layer_add_words(layers + word * stream, stream, m, pixel_index, scale3(v, LAYER_UNITS));
}

/* Adds a number of any size below 2^31. */
inline void layer_add_long(Scene scene, global uint *layers, mask m, integer pixel_index, int word, real v)
{
    size_t stream = scene.settings->padded_pixels;
    v = sel(fabs(v) < 0x1p31f, v, (real)(0.0f));
    real high = floor(v * 0x1p-8f), rest = v - high * 0x1p8f, middle = floor(rest * 0x1p16f);
    vec3 parts = v3(high, middle, floor((rest - middle * 0x1p-16f) * 0x1p40f));
    layer_add_words(layers + word * stream, stream, m, pixel_index, parts);
}
