/* Pixel filters by importance sampling: a sample serves its own pixel, at an offset drawn from |f|.
 * Filters are separable and even, so a half of a dimension is tabulated (clpt/render/film/filters.py) at the
 * beginning of `distributions`: the number of cells n, n + 1 distances that bound cells of equal probability, and the
 * weight of each cell, which is negative where f is. */
inline void filter_sample_axis(Scene scene, real u, real *offset, real *weight)
{
    int n = (int)scene.distributions[0];
    real side = 2.0f * u - 1.0f, x = fabs(side) * (float)n;
    integer i = min_i(to_integer(x), (integer)(n - 1));
    real a = gather(scene.distributions, i + 1), b = gather(scene.distributions, i + 2);
    real distance = a + (x - to_real(i)) * (b - a);
    *offset = sel(side < 0.0f, -distance, distance);
    *weight *= gather(scene.distributions, i + (n + 2));
}

/* offset: from the pixel's centre [pixels]; weight: of the sample, 1 on average. */
inline void filter_sample(Scene scene, vec2 u, vec2 *offset, real *weight)
{
    *weight = 1.0f;
#ifdef FILTER_BOX
    float radius = scene.distributions[2];
    offset->x = (2.0f * u.x - 1.0f) * radius;
    offset->y = (2.0f * u.y - 1.0f) * radius;
#else
    filter_sample_axis(scene, u.x, &offset->x, weight);
    filter_sample_axis(scene, u.y, &offset->y, weight);
#endif
}

/* Step spread: splatting: light at a point of the film serves every pixel whose filter holds the point, each by the
 * filter's value f there. From FILTER_PROFILE on `distributions` has the radius, a number of steps n, and n + 1 values
 * of f from 0 to the radius. FILTER_TAPS: pixels of an axis that may hold a point; FILTER_REACH: their greatest
 * distance from the point's own pixel. */
#include "film/exposure.cl"
#define SPREAD_PIXELS (FILTER_TAPS * FILTER_TAPS)

typedef struct {
    integer x, y;                               /* the first pixel of the picture that may hold the point */
    real across[FILTER_TAPS], down[FILTER_TAPS]; /* f along both axes, from that pixel on */
} Spread;

/* f at a distance, 0 beyond the radius [1/pixel]. */
inline real spread_filter(Scene scene, real distance)
{
    float radius = scene.distributions[FILTER_PROFILE], steps = scene.distributions[FILTER_PROFILE + 1];
    real x = fabs(distance) * (steps / radius);
    mask inside = x <= steps;
    integer i = min_i(to_integer(sel(inside, x, (real)(0.0f))), (integer)((int)steps - 1));
    integer at = i + (FILTER_PROFILE + 2);
    real a = gather(scene.distributions, at), b = gather(scene.distributions, at + 1);
    return sel(inside, a + (x - to_real(i)) * (b - a), (real)(0.0f));
}

/* Along an axis: returns the first pixel that holds a point of the pixel `own`. offset: from that pixel's centre. */
inline integer spread_axis(Scene scene, integer own, real offset, real f[FILTER_TAPS])
{
    real lowest = (float)-FILTER_REACH, highest = (float)(FILTER_REACH + 1 - FILTER_TAPS);
    real first = clamp_r(ceil(offset - scene.distributions[FILTER_PROFILE]), lowest, highest);
    for (int i = 0; i < FILTER_TAPS; i++) f[i] = spread_filter(scene, first + (float)i - offset);
    return own + to_integer(first);
}

/* x, y: the pixel where the point lies; offset: from its centre [pixels]. */
inline Spread spread_point(Scene scene, integer x, integer y, vec2 offset)
{
    Spread s;
    s.x = spread_axis(scene, x, offset.x, s.across);
    s.y = spread_axis(scene, y, offset.y, s.down);
    return s;
}

/* f[i]; on a GPU without an index into an array. */
inline real spread_tap(const real *f, int i)
{
#if LANES == 1
    real found = f[0];
    UNROLLED
    for (int k = 1; k < FILTER_TAPS; k++) found = k == i ? f[k] : found;
    return found;
#else
    return f[i];
#endif
}

/* Whether the picture has pixel `i` among the pixels that may hold the point, its index, and f there. */
inline mask spread_pixel(global const Settings *settings, Spread s, int i, integer *pixel_index, real *f)
{
    integer x = s.x + i % FILTER_TAPS, y = s.y + i / FILTER_TAPS;
    *f = spread_tap(s.across, i % FILTER_TAPS) * spread_tap(s.down, i / FILTER_TAPS);
    *pixel_index = film_pixel_index(settings, x, y);
    return (*f != 0.0f) & (x >= 0) & (x < settings->width) & (y >= 0) & (y < settings->height);
}

#if USES_BANDS
#define SPREAD_ARGS global uint *film, global uint *bands
#define SPREAD_PASSED film, bands
#else
#define SPREAD_ARGS global uint *film
#define SPREAD_PASSED film
#endif

/* Adds light to the pixels whose filters hold its point, where m; to their sums of colours only where `colours`.
 * Returns how many sums are full, lane by lane. */
inline integer spread_add(Scene scene, SPREAD_ARGS, mask m, mask colours, integer part, Spread s, Light light)
{
    integer full = 0;
    ROLLED
    for (int i = 0; i < SPREAD_PIXELS; i++) {
        integer pixel_index;
        real f;
        mask there = m & spread_pixel(scene.settings, s, i, &pixel_index, &f);
        vec3 v = scale3(light.value, f);
        Exposure e = {fixed_of(v.x), fixed_of(v.y), fixed_of(v.z), (natural)(0u)};
#if FILM_WEIGHTS
        e.weight = fixed_of(f);
#endif
#if USES_ALPHA
        e.covered = fixed_of(f * light.covers);
#endif
        full += film_add(scene.settings, film, there & colours, part, pixel_index, e);
#if USES_BANDS
        full += bands_add(scene, bands, there, part, pixel_index, light.radiance, light.lambdas, light.scale * f);
#endif
    }
    return full;
}
