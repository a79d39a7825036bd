/* What pictures read of a film: its sums over all parts, as numbers. For work-items of one lane. */
#include "film/film.cl"

/* One sum as a number. sum: its first word in the first part; size: words of a part. */
inline float parts_sum(global const uint *sum, size_t stream, size_t size, int parts)
{
    Fixed total = fixed_zero();
    for (int i = 0; i < parts; i++) {
        global const uint *word = sum + i * size;
        Fixed f = {word[0], word[stream], word[2 * stream]};
        total = fixed_add(total, f);
    }
    return sums_float(total.low, total.middle, total.high);
}

/* A pixel's three sums, in the group of words that begins at `group`. */
inline vec3 film_sum(global const Settings *settings, global const uint *film, int pixel_index, int group)
{
    size_t stream = settings->padded_pixels, size = FILM_WORDS * stream;
    int parts = film_parts(settings);
    global const uint *first = film + group * stream + pixel_index;
    return v3(parts_sum(first, stream, size, parts), parts_sum(first + 3 * stream, stream, size, parts),
              parts_sum(first + 6 * stream, stream, size, parts));
}

/* How many samples a pixel has. */
inline uint film_samples(global const Settings *settings, global const uint *film, int pixel_index)
{
    size_t stream = settings->padded_pixels;
    uint samples = 0;
    for (int i = 0; i < film_parts(settings); i++)
        samples += film[(i * FILM_WORDS + FILM_SAMPLES) * stream + pixel_index];
    return samples;
}

/* The number of samples of a pixel in a picture: its own, or, of light paths, how many there were per pixel, which the
 * host says, as each may have lit any pixel. */
#if LIGHT_PATHS || SUMS_LIGHT_PATHS
#define LIGHT_PATHS_ARG , float light_paths
#else
#define LIGHT_PATHS_ARG
#endif
#if LIGHT_PATHS
#define SAMPLES light_paths
#else
#define SAMPLES (float)film_samples(settings, film, pixel_index)
#endif

#if SUMS_LIGHT_PATHS
/* One over what the sums of light paths are divided by; 0 where a pixel has no samples: it stays black. */
inline float light_paths_mean(float light_paths, float samples)
{
    return light_paths > 0.0f && samples > 0.0f ? 1.0f / light_paths : 0.0f;
}
#endif

/* One over what a pixel's sums are divided by: its samples, or, of samples that serve several pixels, their weight. */
inline float film_mean(global const Settings *settings, global const uint *film, int pixel_index, float samples)
{
#if FILM_WEIGHTS
    size_t stream = settings->padded_pixels;
    samples = parts_sum(film + FILM_WEIGHT * stream + pixel_index, stream, FILM_WORDS * stream, film_parts(settings));
#endif
    return samples > 0.0f ? 1.0f / samples : 0.0f;
}
