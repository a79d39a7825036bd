/* The random numbers of a sample of a pixel. */
#include "film/pixel.cl"

/* Step. */
/* A pixel is known by its number in the whole film: a crop has the samples of the whole picture. */
inline natural pixel_key(global const Settings *settings, integer pixel_index)
{
    integer x, y;
    pixel_place(settings, pixel_index, &x, &y);
    int margin = settings->margin, width = settings->film_width + 2 * margin;
    return as_natural((y + (settings->crop_y + margin)) * width + x + (settings->crop_x + margin));
}

inline Sampler pixel_sampler(global const Settings *settings, natural key, integer sample)
{
    return sampler_start(settings->seed, key, as_natural(sample));
}

/* Step z: a pixel is known by its place on the Z curve over the whole film: bits of x and y alternate (Morton 1966). */
inline natural spread_bits(natural x) /* 16 bits to every second bit of 32 */
{
    x = (x | (x << 8u)) & 0x00ff00ffu;
    x = (x | (x << 4u)) & 0x0f0f0f0fu;
    x = (x | (x << 2u)) & 0x33333333u;
    return (x | (x << 1u)) & 0x55555555u;
}

inline natural pixel_key(global const Settings *settings, integer pixel_index)
{
    integer x, y;
    pixel_place(settings, pixel_index, &x, &y);
    int margin = settings->margin;
    natural column = as_natural(x + (settings->crop_x + margin)), row = as_natural(y + (settings->crop_y + margin));
    return spread_bits(column) | (spread_bits(row) << 1u);
}

inline Sampler pixel_sampler(global const Settings *settings, natural key, integer sample)
{
    return zsobol_start(settings->seed, (uint)settings->sample_bits, key, as_natural(sample));
}
