/* The random numbers of paths from lights. */
#include "film/pixel.cl"
#define LIGHT_PATH_SEED 0x5bd1e995u /* keeps their numbers apart from those of paths from the camera */

#if USES_GUIDE
/* Counts light paths from which a guide learns: the first ones are the same whatever the film is. */
inline integer light_path_number(global const Settings *settings, integer pixel_index, integer sample)
{
    integer x, y;
    pixel_place(settings, pixel_index, &x, &y);
    int width = settings->width + 2 * settings->margin, height = settings->height + 2 * settings->margin;
    return (sample * height + y + settings->margin) * width + x + settings->margin;
}
#endif

/* The random numbers of a path from a light. Its "pixel" only counts paths: those of one sample number are the points
 * of one sequence, so that they spread evenly over the lights. */
inline Sampler light_path_sampler(global const Settings *settings, integer pixel_index, integer sample)
{
#if USES_GUIDE
    natural number = as_natural(light_path_number(settings, pixel_index, sample));
    return sampler_start(settings->seed ^ LIGHT_PATH_SEED, (natural)(0u), number);
#else
    return sampler_start(settings->seed ^ LIGHT_PATH_SEED, as_natural(sample), as_natural(pixel_index));
#endif
}
