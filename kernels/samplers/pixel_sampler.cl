/* The random numbers of a sample of a pixel, which is known by its number in the whole film: a crop has the samples of
 * the whole picture. */
#include "film/pixel.cl"

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
