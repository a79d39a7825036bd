/* The random numbers of a sample of a pixel, pixels along the Z curve: bits of x and y alternate (Morton 1966). */
#include "film/pixel.cl"

inline natural spread_bits(natural x) /* of 16 to every other one of 32 */
{
    x = (x | (x << 8u)) & 0x00ff00ffu;
    x = (x | (x << 4u)) & 0x0f0f0f0fu;
    x = (x | (x << 2u)) & 0x33333333u;
    return (x | (x << 1u)) & 0x55555555u;
}

inline Sampler pixel_sampler(global const Settings *settings, integer pixel_index, integer sample)
{
    vec2 p = pixel_of_index(settings, pixel_index);
    natural x = to_natural(p.x) + (uint)settings->crop_x, y = to_natural(p.y) + (uint)settings->crop_y;
    return zsobol_start(settings->seed, (uint)settings->sample_bits, spread_bits(x) | (spread_bits(y) << 1u),
                        as_natural(sample));
}
