/* A spectral film: settings->bands equal parts of the film's range of wavelengths. Beside the film of colours there is
 * a sum per band, three streams of `padded_pixels` words each. What is summed is radiance over the density of
 * wavelengths and the width of a band, so that its mean is the mean radiance in the band [W m^-2 sr^-1 nm^-1]. */

/* The first word of a band of a pixel, in the half of the film that a plane's samples go to. */
inline size_t bands_at(global const Settings *settings, int plane, int band, int pixel_index)
{
    int half_film = plane & (settings->halves - 1);
    return (size_t)3 * (half_film * settings->bands + band) * settings->padded_pixels + pixel_index;
}

/* Adds `weight` times the radiance of paths to the bands of their wavelengths. Returns how many sums are full. */
inline integer bands_add(Scene scene, global uint *bands, mask m, integer plane, integer pixel_index,
                         Spectrum radiance, Wavelengths lambdas, real weight)
{
    global const Settings *settings = scene.settings;
    float lo = settings->lambda_min, width = (settings->lambda_max - lo) / (float)settings->bands;
    Spectrum value = wavelengths_weigh(scene, radiance, lambdas);
    integer full = 0, last = settings->bands - 1;
    weight *= 0.25f / width;
#define ADD(i)                                                                                                      \
    if (LANE(m, i)) {                                                                                               \
        global uint *at = bands + bands_at(settings, LANE(plane, i), LANE(band, i), LANE(pixel_index, i));          \
        LANE(full, i) += sums_add(at, settings->padded_pixels, LANE(f.low, i), LANE(f.middle, i), LANE(f.high, i)); \
    }
#define C(c)                                                                                   \
    {                                                                                          \
        integer band = max_i(min_i(to_integer((lambdas.c - lo) / width), last), (integer)(0)); \
        real term = value.c * weight;                                                          \
        Fixed f = fixed_of(sel(m & (fabs(term) < FIXED_LARGEST), term, (real)(0.0f)));         \
        FOR_LANES(ADD)                                                                         \
    }
    SPECTRUM_EACH(C)
#undef C
#undef ADD
    return full;
}
