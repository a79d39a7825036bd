/* A spectral film: settings->bands equal parts of the film's range of wavelengths. Beside the film of colours there is
 * a sum per band, three streams of `padded_pixels` words each, and likewise for light paths where the film has a second
 * group of words. What is summed is radiance over the density of wavelengths and the width of a band, so that its mean
 * is the mean radiance in the band [W m^-2 sr^-1 nm^-1]. */

/* The first word of a band of a pixel, in a part of the film. group: 0 or 1. */
inline size_t bands_at(global const Settings *settings, int part, int group, int band, int pixel_index)
{
    int row = (part * FILM_GROUPS + group) * settings->bands + band;
    return (size_t)3 * row * settings->padded_pixels + pixel_index;
}

/* Adds a number to a band of each pixel, lane by lane as `film_add` does. */
inline integer band_add(global const Settings *settings, global uint *bands, mask m, integer part, integer band,
                        integer pixel_index, Fixed f)
{
    integer full = 0;
    const int *at_lane = (const int *)&m, *parts = (const int *)&part, *own = (const int *)&band;
    const int *pixels = (const int *)&pixel_index;
    const uint *words = (const uint *)&f;
    for (int i = 0; i < LANES; i++) {
        if (!at_lane[i]) continue;
        global uint *at = bands + bands_at(settings, parts[i], FILM_GROUP > 0, own[i], pixels[i]);
        const uint *w = words + i;
        ((int *)&full)[i] = (int)sums_add(at, settings->padded_pixels, w[0], w[LANES], w[2 * LANES]);
    }
    return full;
}

/* Adds `weight` times the radiance of paths to the bands of their wavelengths. Returns how many sums are full. */
inline integer bands_add(Scene scene, global uint *bands, mask m, integer part, integer pixel_index,
                         Spectrum radiance, Wavelengths lambdas, real weight)
{
    global const Settings *settings = scene.settings;
    float lo = settings->lambda_min, width = (settings->lambda_max - lo) / (float)settings->bands;
    Spectrum value = wavelengths_weigh(scene, radiance, lambdas);
    integer full = 0, last = settings->bands - 1;
    weight *= 0.25f / width;
#define C(c)                                                                                                          \
    {                                                                                                                 \
        integer band = max_i(min_i(to_integer((lambdas.c - lo) / width), last), (integer)(0));                        \
        real term = value.c * weight;                                                                                 \
        mask taken = m & (fabs(term) < FIXED_LARGEST);                                                                \
        full += band_add(settings, bands, taken, part, band, pixel_index, fixed_of(sel(taken, term, (real)(0.0f))));  \
    }
    SPECTRUM_EACH(C)
#undef C
    return full;
}
