/* Splatting: light at a point of the film serves every pixel whose filter holds the point, each by the filter's value f
 * there. Filters are separable and even: from FILTER_PROFILE on `distributions` has the radius, a number of steps n,
 * and n + 1 values of f from 0 to the radius (clpt/render/film/filters.py). FILTER_TAPS: how many pixels of
 * an axis hold a point at most; FILTER_REACH: how far they are from its own. */
#include "film/light.cl"
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

/* Along an axis: `own`, the pixel of a point, becomes the first that holds it. offset: from that pixel's centre. */
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

/* Whether the picture has the pixel `i` of those that may hold the point, where it is stored, and f there. */
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
