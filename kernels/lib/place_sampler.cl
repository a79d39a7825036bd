/* The numbers of a sample of a place of the film. */
inline Sampler place_sampler(global const Settings *settings, integer place, integer sample)
{
    return sampler_start(settings->seed, as_natural(place), as_natural(sample));
}
