/* Light that comes to a film: of a sample, or of a path from a light. */
#include "film/film.cl"
#include "generated/bands.cl"

typedef struct {
    vec3 value;          /* of the film's three channels, times `scale` */
    int small;           /* whether fixed_of_small takes all values */
    real covers;         /* the share of the background that the sample covers */
    Spectrum radiance;   /* for a film of bands, which takes `scale` times this */
    Wavelengths lambdas;
    real scale;
} Light;

/* Step own_pixel: samples serve their own pixel, at positions drawn from its filter: a slot sums the samples of its
 * pixel as words of its path's state, until it leaves the pixel. */
#include "film/filter.cl"

/* The position of the sample of a pixel, from the pixel's centre [pixels]. */
inline vec2 exposure_begin(Scene scene, Slab path, uint at, mask go, Sampler sampler)
{
    vec2 offset = {0.0f, 0.0f};
    real weight = 1.0f;
    filter_sample(scene, sampler_pair(sampler, (natural)(DIMENSION_FILM)), &offset, &weight);
    store_path_weight(path, at, go, weight);
    return offset;
}

/* The weight of that sample, 1 on average. */
inline real exposure_weight(Slab path, uint at) { return load_path_weight(path, at); }

/* Adds a value and a sample where m; small: all values are, as they mostly are. The highest words of sums then change
 * only by a carry, once in 2^16 of the sum: they are read and written only where they change. */
inline void exposure_sum(Slab path, uint at, global uint *counters, mask m, vec3 value, int small)
{
    value = sel3(m, value, v3(0.0f, 0.0f, 0.0f));
    Natural3 low = load_path_low(path, at), middle = load_path_middle(path, at), high;
#define ADD(c)                                                                            \
    {                                                                                     \
        Fixed before = {low.c, middle.c, (natural)(0u)};                                  \
        Fixed f = fixed_add(before, small ? fixed_of_small(value.c) : fixed_of(value.c)); \
        low.c = f.low;                                                                    \
        middle.c = f.middle;                                                              \
        high.c = f.high;                                                                  \
    }
    ADD(x) ADD(y) ADD(z)
#undef ADD
    store_path_low(path, at, m, low);
    store_path_middle(path, at, m, middle);
    store_path_samples(path, at, m, load_path_samples(path, at) + 1u);
    if (any(m & ((high.x | high.y | high.z) != 0u))) {
        Natural3 before = load_path_high(path, at);
        high.x += before.x;
        high.y += before.y;
        high.z += before.z;
        store_path_high(path, at, m, high);
        count(counters, COUNTER_FULL, m & (fixed_is_full(high.x) | fixed_is_full(high.y) | fixed_is_full(high.z)),
              (integer)(1));
    }
}

/* Adds the share that a sample covers, by its weight. */
inline void exposure_cover(Slab path, uint at, mask m, real weight)
{
    store_path_covered(path, at, m, fixed_add(load_path_covered(path, at), fixed_of(sel(m, weight, (real)(0.0f)))));
}

/* Adds finished samples. */
inline void exposure_add(Scene scene, Slab path, uint at, BEGIN_ARGS, mask m, integer part, integer pixel_index,
                         integer sample, Light light)
{
    exposure_sum(path, at, counters, m, light.value, light.small);
#if USES_ALPHA
    exposure_cover(path, at, m, load_path_weight(path, at) * light.covers);
#endif
#if USES_BANDS
    integer full = bands_add(scene, bands, m, part, pixel_index, light.radiance, light.lambdas, light.scale);
    count(counters, COUNTER_FULL, m & (full > 0), full);
#endif
}

/* Adds the sums of slots that `leave` a part of the film, or their pixels, to that part; sums begin at 0 in slots that
 * `enter` another pixel or part. */
inline void exposure_leave(Scene scene, Slab path, uint at, BEGIN_ARGS, mask leave, mask enter, integer part,
                           integer pixel_index)
{
    Natural3 low = load_path_low(path, at), middle = load_path_middle(path, at), high = load_path_high(path, at), none;
    Exposure e = {{low.x, middle.x, high.x}, {low.y, middle.y, high.y}, {low.z, middle.z, high.z},
                  load_path_samples(path, at)};
    none.x = none.y = none.z = 0u;
    store_path_low(path, at, enter, none);
    store_path_middle(path, at, enter, none);
    store_path_high(path, at, enter, none);
    store_path_samples(path, at, enter, none.x);
#if USES_ALPHA
    e.covered = load_path_covered(path, at);
    store_path_covered(path, at, enter, fixed_zero());
#endif
    integer full = film_add(scene.settings, film, leave, part, pixel_index, e);
    count(counters, COUNTER_FULL, leave & (full > 0), full);
}

/* Step splatting: samples serve all pixels whose filters hold them (film/filter.cl). They lie anywhere in their pixel,
 * evenly, and a pixel of the picture is the mean of the samples near it, weighted by its filter. */
#include "film/filter.cl#spread"

/* A slot sums its samples in a footprint of its own, FOOTPRINT x FOOTPRINT pixels around its pixel, and adds the
 * footprint to the film when it leaves the pixel: so a sample costs no atomic operation. `footprints` holds 64-bit
 * numbers in units of 2^-44 for each pixel: the film's three channels and the filter's value; then, with alpha, the
 * share that is covered. */
#define FOOTPRINT (2 * FILTER_REACH + 1)
#define FOOTPRINT_UNITS 0x1p44f
#define FOOTPRINT_SHIFT 4         /* from these units to the film's */
#define FOOTPRINT_LARGEST 256.0f  /* of a value; brighter values go to the film at once */
#define FOOTPRINT_SAMPLES 2048u   /* a sum has room for that many */
#if USES_ALPHA
#define FOOTPRINT_VECTORS 2
#else
#define FOOTPRINT_VECTORS 1
#endif

inline vec2 splat_offset(Sampler sampler)
{
    vec2 u = sampler_pair(sampler, (natural)(DIMENSION_FILM)), offset = {u.x - 0.5f, u.y - 0.5f};
    return offset;
}

inline vec2 exposure_begin(Scene scene, Slab path, uint at, mask go, Sampler sampler) { return splat_offset(sampler); }

inline real exposure_weight(Slab path, uint at) { return 1.0f; }

/* The footprint of the slot that lane `i` serves. */
inline global long4 *footprint_of(global long *footprints, uint at, int i)
{
    return (global long4 *)footprints + (size_t)(at + i) * (FOOTPRINT * FOOTPRINT * FOOTPRINT_VECTORS);
}

/* Adds a lane's light to its footprint, whose first pixel that holds the sample is `first`. */
inline void footprint_add(global long4 *first, const real *across, const real *down, int i, float4 value, float covers)
{
    for (int y = 0; y < FILTER_TAPS; y++)
        for (int x = 0; x < FILTER_TAPS; x++) {
            real column = spread_tap(across, x), row = spread_tap(down, y);
            float f = ((const float *)&column)[i] * ((const float *)&row)[i];
            global long4 *pixel = first + (y * FOOTPRINT + x) * FOOTPRINT_VECTORS;
            pixel[0] += convert_long4(value * f * FOOTPRINT_UNITS);
#if USES_ALPHA
            pixel[1].x += convert_long(covers * f * FOOTPRINT_UNITS);
#endif
        }
}

/* Adds a sum of a footprint to a sum of the film. Returns 1 if that is full then, else 0. */
inline uint footprint_sum(global uint *sum, size_t stream, long v)
{
    return sums_add(sum, stream, (uint)(v << FOOTPRINT_SHIFT), (uint)(v >> (32 - FOOTPRINT_SHIFT)),
                    (uint)(v >> (64 - FOOTPRINT_SHIFT)));
}

/* Adds a footprint around the pixel (x, y) to the film and empties it. Returns how many sums are full. */
inline uint footprint_leave(global const Settings *settings, global uint *film, global long4 *own, int part, int x,
                            int y)
{
    size_t stream = settings->padded_pixels;
    uint full = 0;
    ROLLED
    for (int i = 0; i < FOOTPRINT * FOOTPRINT; i++) {
        global long4 *pixel = own + i * FOOTPRINT_VECTORS;
        long4 v = pixel[0];
        int px = x + i % FOOTPRINT - FILTER_REACH, py = y + i / FOOTPRINT - FILTER_REACH;
        if (v.w && px >= 0 && px < settings->width && py >= 0 && py < settings->height) {
            int column = px + settings->margin, row = py + settings->margin;
            int tile = (row >> 2) * settings->tiles_x + (column >> 2);
            global uint *at = film + film_at(settings, part, tile * 16 + (row & 3) * 4 + (column & 3));
            full += footprint_sum(at, stream, v.x) + footprint_sum(at + 3 * stream, stream, v.y) +
                    footprint_sum(at + 6 * stream, stream, v.z) + footprint_sum(at + FILM_WEIGHT * stream, stream, v.w);
#if USES_ALPHA
            full += footprint_sum(at + FILM_ALPHA * stream, stream, pixel[1].x);
#endif
        }
        for (int k = 0; k < FOOTPRINT_VECTORS; k++) pixel[k] = (long4)(0);
    }
    return full;
}

/* Adds the sums of slots that `leave` a pixel to a part of the film. */
inline void exposure_leave(Scene scene, Slab path, uint at, BEGIN_ARGS, mask leave, mask enter, integer part,
                           integer pixel_index)
{
    integer x, y, full = 0;
    pixel_place(scene.settings, pixel_index, &x, &y);
    natural taken = load_path_samples(path, at);
    const int *at_lane = (const int *)&leave, *parts = (const int *)&part, *pixels = (const int *)&pixel_index;
    const int *columns = (const int *)&x, *rows = (const int *)&y;
    for (int i = 0; i < LANES; i++) {
        if (!at_lane[i]) continue;
        global uint *own = film + film_at(scene.settings, parts[i], pixels[i]);
        sums_add_word(own + FILM_SAMPLES * (size_t)scene.settings->padded_pixels, ((const uint *)&taken)[i]);
        ((int *)&full)[i] = (int)footprint_leave(scene.settings, film, footprint_of(footprints, at, i), parts[i],
                                                 columns[i], rows[i]);
    }
    store_path_samples(path, at, leave | enter, (natural)(0u));
    count(counters, COUNTER_FULL, leave & (full > 0), full);
}

/* Adds finished samples. */
inline void exposure_add(Scene scene, Slab path, uint at, BEGIN_ARGS, mask m, integer part, integer pixel_index,
                         integer sample, Light light)
{
    Sampler sampler = pixel_sampler(scene.settings, load_path_pixel_key(path, at), sample);
    integer own_x, own_y, full = 0;
    pixel_place(scene.settings, pixel_index, &own_x, &own_y);
    Spread s = spread_point(scene, own_x, own_y, splat_offset(sampler));
    vec3 v = light.value;
    mask bright = m & (max_r(max_r(fabs(v.x), fabs(v.y)), fabs(v.z)) >= FOOTPRINT_LARGEST);
#if USES_BANDS /* which have no footprints */
    mask at_once = m;
#else
    mask at_once = bright;
#endif
    if (any(at_once)) full = spread_add(scene, SPREAD_PASSED, at_once, bright, part, s, light);
    count(counters, COUNTER_FULL, m & (full > 0), full);
    natural taken = load_path_samples(path, at) + 1u;
    store_path_samples(path, at, m, taken);
    mask adds = m & !bright;
    integer first = (s.y - own_y + FILTER_REACH) * FOOTPRINT + (s.x - own_x + FILTER_REACH);
    real covers = light.covers;
    const int *at_lane = (const int *)&adds, *firsts = (const int *)&first;
    const float *r = (const float *)&v.x, *g = (const float *)&v.y, *b = (const float *)&v.z;
    for (int i = 0; i < LANES; i++) {
        if (!at_lane[i]) continue;
        global long4 *own = footprint_of(footprints, at, i) + firsts[i] * FOOTPRINT_VECTORS;
        footprint_add(own, s.across, s.down, i, (float4)(r[i], g[i], b[i], 1.0f), ((const float *)&covers)[i]);
    }
    mask many = m & (taken >= FOOTPRINT_SAMPLES);
    if (any(many)) exposure_leave(scene, path, at, BEGIN_PASSED, many, mask_of(0), part, pixel_index);
}
