/* The random numbers of paths from lights. */
#define LIGHT_PATH_SEED 0x5bd1e995u /* keeps their numbers apart from those of paths from the camera */

/* The random numbers of a path from a light. Its "pixel" only counts paths: those of one sample number are the points
 * of one sequence, so that they spread evenly over the lights. */
inline Sampler light_path_sampler(global const Settings *settings, integer pixel_index, integer sample)
{
    return sampler_start(settings->seed ^ LIGHT_PATH_SEED, as_natural(sample), as_natural(pixel_index));
}
