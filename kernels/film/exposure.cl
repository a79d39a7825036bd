/* Samples that serve their own pixel, at places drawn from its filter: a slot sums those of the pixel that it is in as
 * words of its path's state, until it leaves the pixel. See film/light.cl. */
#include "film/light.cl"
#include "film/filter.cl"

/* Where the sample of a pixel lies, from the pixel's centre [pixels]. */
inline vec2 exposure_begin(Scene scene, Slab path, uint at, mask go, Sampler sampler)
{
    vec2 offset = {0.0f, 0.0f};
    real weight = 1.0f;
    filter_sample(scene, sampler_pair(sampler, (natural)(DIMENSION_FILM)), &offset, &weight);
    store_path_weight(path, at, go, weight);
    return offset;
}

/* What that counts, 1 on average. */
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

/* Adds how much a sample covers, by its weight. */
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

/* Gives a part of the film what was summed where slots `leave` it or their pixels, and begins again at 0 where they
 * `enter` others. */
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
