/* The film while it is being exposed. A film is FILM_WORDS streams of `padded_pixels` words, or, where even and odd
 * samples are kept apart, two times as many. Slots of several planes may render the same pixel: it is added to by
 * atomics. */
#include "film/pixel.cl"
#include "film/sums.cl"
#define FILM_SAMPLES 9 /* after the sums of three channels, three words each: the number of samples */
#if USES_ALPHA
#define FILM_ALPHA 10 /* then the sum of what is covered */
#define FILM_WORDS 13
#else
#define FILM_WORDS 10
#endif

/* Whether the film takes a value: neither NaN nor so large that sums would overflow. */
inline mask film_accepts(vec3 value) { return fabs(value.x) + fabs(value.y) + fabs(value.z) < FIXED_LARGEST; }

/* What slots have summed of a pixel: three channels, the number of samples, and what is covered. */
typedef struct {
    Fixed first, second, third;
    natural samples;
#if USES_ALPHA
    Fixed covered;
#endif
} Exposure;

/* The first word of a pixel in the half of the film that a plane's samples go to: even or odd ones, where these are
 * kept apart and planes are an even number; else the only one. */
inline size_t film_at(global const Settings *settings, int plane, int pixel_index)
{
    int half_film = plane & (settings->halves - 1);
    return (size_t)half_film * FILM_WORDS * settings->padded_pixels + pixel_index;
}

/* Adds what slots have summed to their pixels. Returns how many sums are full, lane by lane. */
inline integer film_add(global const Settings *settings, global uint *film, mask m, integer plane,
                        integer pixel_index, Exposure e)
{
    size_t stream = settings->padded_pixels;
    integer full = 0;
#define SUM(i, word, f) \
    LANE(full, i) += sums_add(at + (word) * stream, stream, LANE((f).low, i), LANE((f).middle, i), LANE((f).high, i))
#if USES_ALPHA
#define ADD_ALPHA(i) SUM(i, FILM_ALPHA, e.covered);
#else
#define ADD_ALPHA(i)
#endif
#define ADD(i)                                                                            \
    if (LANE(m, i)) {                                                                     \
        global uint *at = film + film_at(settings, LANE(plane, i), LANE(pixel_index, i)); \
        SUM(i, 0, e.first);                                                               \
        SUM(i, 3, e.second);                                                              \
        SUM(i, 6, e.third);                                                               \
        sums_add_word(at + FILM_SAMPLES * stream, LANE(e.samples, i));                    \
        ADD_ALPHA(i)                                                                      \
    }
    FOR_LANES(ADD)
#undef ADD
#undef ADD_ALPHA
#undef SUM
    return full;
}

/* Counts a sample in each pixel where something else adds its value. */
inline void film_count(global const Settings *settings, global uint *film, mask m, integer plane, integer pixel_index)
{
    size_t samples = (size_t)FILM_SAMPLES * settings->padded_pixels;
#define ADD(i)                                                                                        \
    if (LANE(m, i)) {                                                                                 \
        size_t at = film_at(settings, LANE(plane, i), LANE(pixel_index, i));                          \
        atomic_inc((volatile global uint *)(film + at + samples));                                    \
    }
    FOR_LANES(ADD)
#undef ADD
}

/* Counters that the host reads while it enqueues, two words each, the lower first. */
#define COUNTER_DONE 0     /* slots that have come to the end of their work list */
#define COUNTER_SAMPLES 1  /* paths put on the film */
#define COUNTER_CLOSEST 2  /* rays of them */
#define COUNTER_SHADOW 3   /* shadow rays of them */
#define COUNTER_REJECTED 4 /* samples that were not finite, or too bright, and count as black */
#define COUNTER_FULL 5     /* times when a sum was found near the end of its range */
inline void count(global uint *counters, int which, mask m, integer v)
{
    if (any(m) && sums_add_word(counters + 2 * which, (uint)sum_lanes(sel_i(m, v, (integer)(0)))))
        atomic_inc((volatile global uint *)(counters + 2 * which + 1));
}
