/* Pictures read a film's sums over all parts, as numbers. For work-items of a single lane. */
#include "film/film.cl"
#define FILM_PARTS (settings->halves * settings->octaves) /* film/work_list.cl */

/* A sum as a number. sum: its first word in the first part. */
inline float parts_sum(global const Settings *settings, global const uint *sum)
{
    size_t stream = settings->padded_pixels;
    Fixed total = fixed_zero();
    for (int i = 0; i < FILM_PARTS; i++) {
        global const uint *word = sum + i * FILM_WORDS * stream;
        Fixed f = {word[0], word[stream], word[2 * stream]};
        total = fixed_add(total, f);
    }
    return sums_float(total.low, total.middle, total.high);
}

/* A pixel's three sums, in the group of words that begins at `group`. */
inline vec3 film_sum(global const Settings *settings, global const uint *film, int pixel_index, int group)
{
    size_t stream = settings->padded_pixels;
    global const uint *at = film + group * stream + pixel_index;
    return v3(parts_sum(settings, at), parts_sum(settings, at + 3 * stream), parts_sum(settings, at + 6 * stream));
}

/* The number of samples of a pixel. */
inline uint film_samples(global const Settings *settings, global const uint *film, int pixel_index)
{
    size_t stream = settings->padded_pixels, at = FILM_SAMPLES * stream + pixel_index;
    uint samples = 0;
    for (int i = 0; i < FILM_PARTS; i++) samples += film[i * FILM_WORDS * stream + at];
    return samples;
}

/* The number of samples of a pixel in a picture: its own or, of light paths, the number per pixel, which the host
 * gives, as each may have lit any pixel. */
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
/* The factor from sums of light paths to their mean; 0 where a pixel has no samples: it stays black. */
inline float light_paths_mean(float light_paths, float samples)
{
    return light_paths > 0.0f && samples > 0.0f ? 1.0f / light_paths : 0.0f;
}
#endif

/* The factor from a pixel's sums to their mean: by its samples or, if samples serve several pixels, by their weight. */
inline float film_mean(global const Settings *settings, global const uint *film, int pixel_index, float samples)
{
#if FILM_WEIGHTS
    samples = parts_sum(settings, film + FILM_WEIGHT * (size_t)settings->padded_pixels + pixel_index);
#endif
    return samples > 0.0f ? 1.0f / samples : 0.0f;
}
