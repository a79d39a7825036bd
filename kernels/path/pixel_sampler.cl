/* The random numbers of a sample of a pixel. */
inline Sampler pixel_sampler(global const Settings *settings, integer pixel_index, integer sample)
{
    return sampler_start(settings->seed, as_natural(pixel_index), as_natural(sample));
}
