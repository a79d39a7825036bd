/* The random numbers of a sample of a pixel. */
#include "film/pixel.cl"

inline Sampler pixel_sampler(global const Settings *settings, integer pixel_index, integer sample)
{
    return sampler_start(settings->seed, pixel_key(settings, pixel_index), as_natural(sample));
}
