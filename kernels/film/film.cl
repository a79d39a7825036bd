/* The film while it is being exposed. A film is FILM_WORDS streams of `padded_pixels` words, or, where even and odd
 * samples are kept apart, two times as many. Slots of several planes may render the same pixel: it is added to by
 * atomics. Where paths from lights are weighed against those from the camera, a film has two groups of words: first
 * that of the camera's paths, then that of light paths; a program adds to the group that begins at FILM_GROUP. */
#include "film/pixel.cl"
#include "core/fixed.cl"
#define FILM_SAMPLES 9 /* after the sums of three channels, three words each: the number of samples */
#if FILM_WEIGHTS
#define FILM_WEIGHT 10 /* then the sum of the filter's values, where samples serve several pixels */
#define FILM_ALPHA 13
#else
#define FILM_ALPHA 10
#endif
#if USES_ALPHA
#define FILM_GROUP_WORDS (FILM_ALPHA + 3) /* then the sum of covered shares */
#else
#define FILM_GROUP_WORDS FILM_ALPHA
#endif
#ifndef FILM_GROUP /* a single group */
#define FILM_GROUP 0
#define FILM_WORDS FILM_GROUP_WORDS
#define FILM_GROUPS 1
#else
#define FILM_GROUPS 2
#endif

/* Whether the film takes a value: neither NaN nor so large that sums would overflow. */
inline mask film_accepts(vec3 value) { return fabs(value.x) + fabs(value.y) + fabs(value.z) < FIXED_LARGEST; }

/* What slots have summed of a pixel: three channels, the number of samples, their weight, and what is covered. */
typedef struct {
    Fixed first, second, third;
    natural samples;
#if FILM_WEIGHTS
    Fixed weight;
#endif
#if USES_ALPHA
    Fixed covered;
#endif
} Exposure;

/* The first word of a pixel's group in a part of the film. */
inline size_t film_at(global const Settings *settings, int part, int pixel_index)
{
    return (size_t)(part * FILM_WORDS + FILM_GROUP) * settings->padded_pixels + pixel_index;
}

/* Adds what slots have summed to their pixels. Returns how many sums are full, lane by lane. A loop, as its text for
 * every lane would take longer to compile than to run. */
inline integer film_add(global const Settings *settings, global uint *film, mask m, integer part,
                        integer pixel_index, Exposure e)
{
    size_t stream = settings->padded_pixels;
    integer full = 0;
    const int *at_lane = (const int *)&m, *parts = (const int *)&part, *pixels = (const int *)&pixel_index;
    const uint *words = (const uint *)&e; /* as the members of Exposure lie in memory, LANES numbers each */
    for (int i = 0; i < LANES; i++) {
        if (!at_lane[i]) continue;
        global uint *at = film + film_at(settings, parts[i], pixels[i]);
        uint count = 0;
        sums_add_word(at + FILM_SAMPLES * stream, words[FILM_SAMPLES * LANES + i]);
        UNROLLED
        for (int sum = 0; sum < (FILM_GROUP_WORDS - 1) / 3; sum++) {
            int word = 3 * sum + (3 * sum >= FILM_SAMPLES);
            const uint *w = words + word * LANES + i;
            count += sums_add(at + word * stream, stream, w[0], w[LANES], w[2 * LANES]);
        }
        ((int *)&full)[i] = (int)count;
    }
    return full;
}

/* Counts a sample in each pixel where something else adds its value. */
inline void film_count(global const Settings *settings, global uint *film, mask m, integer part, integer pixel_index)
{
    const int *at_lane = (const int *)&m, *parts = (const int *)&part, *pixels = (const int *)&pixel_index;
    for (int i = 0; i < LANES; i++)
        if (at_lane[i])
            sums_add_word(film + film_at(settings, parts[i], pixels[i]) + FILM_SAMPLES * settings->padded_pixels, 1u);
}

#include "generated/counter_numbers.cl"
inline void count(global uint *counters, int which, mask m, integer v)
{
    if (any(m) && sums_add_word(counters + 2 * which, (uint)sum_lanes(sel_i(m, v, (integer)(0)))))
        atomic_inc((volatile global uint *)(counters + 2 * which + 1));
}
