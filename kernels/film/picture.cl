/* What pictures read of a film: its sums as numbers. Halves: the films of even and of odd samples, from the first one
 * that is wanted to the one before `end`; a film that is not divided is one half. For work-items of one lane. */
#include "film/film.cl"

/* One sum over halves, as a number. sum: its first word in the first half; size: words of a half. */
inline float halves_sum(global const uint *sum, size_t stream, size_t size, int2 halves)
{
    Fixed total = fixed_zero();
    for (int i = halves.x; i < halves.y; i++) {
        global const uint *word = sum + i * size;
        Fixed f = {word[0], word[stream], word[2 * stream]};
        total = fixed_add(total, f);
    }
    return sums_float(total.low, total.middle, total.high);
}

/* A pixel's three sums, in the group of words that begins at `group`. */
inline vec3 film_sum(global const Settings *settings, global const uint *film, int pixel_index, int2 halves, int group)
{
    size_t stream = settings->padded_pixels, size = FILM_WORDS * stream;
    global const uint *first = film + group * stream + pixel_index;
    return v3(halves_sum(first, stream, size, halves), halves_sum(first + 3 * stream, stream, size, halves),
              halves_sum(first + 6 * stream, stream, size, halves));
}

/* How many samples a pixel has. */
inline uint film_samples(global const Settings *settings, global const uint *film, int pixel_index, int2 halves)
{
    size_t stream = settings->padded_pixels;
    uint samples = 0;
    for (int i = halves.x; i < halves.y; i++) samples += film[(i * FILM_WORDS + FILM_SAMPLES) * stream + pixel_index];
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
#define SAMPLES (float)film_samples(settings, film, pixel_index, halves)
#endif

#if SUMS_LIGHT_PATHS
/* One over what the sums of light paths are divided by; 0 where a pixel has no samples: it stays black. */
inline float light_paths_mean(float light_paths, float samples)
{
    return light_paths > 0.0f && samples > 0.0f ? 1.0f / light_paths : 0.0f;
}
#endif

/* One over what a pixel's sums are divided by: its samples, or, of samples that serve several pixels, their weight. */
inline float film_mean(global const Settings *settings, global const uint *film, int pixel_index, int2 halves,
                       float samples)
{
#if FILM_WEIGHTS
    size_t stream = settings->padded_pixels;
    samples = halves_sum(film + FILM_WEIGHT * stream + pixel_index, stream, FILM_WORDS * stream, halves);
#endif
    return samples > 0.0f ? 1.0f / samples : 0.0f;
}
