/* A spectral film: settings->bands equal parts of the film's range of wavelengths. Beside the film of colours
 * there are a sum and its compensation (Neumaier) per band, a stream of `padded_pixels` each, per plane. What is
 * summed is radiance over the density of wavelengths and the width of a band, so that its mean is the
 * mean radiance in the band [W m^-2 sr^-1 nm^-1]. */

inline void bands_add(Scene scene, global float *bands, mask m, integer plane, integer pixel_index, Spectrum radiance,
                      Wavelengths lambdas, real weight)
{
    global const Settings *settings = scene.settings;
    int padded_pixels = settings->padded_pixels, count = settings->bands;
    float lo = settings->lambda_min, width = (settings->lambda_max - lo) / (float)count;
    Spectrum value = wavelengths_weigh(scene, radiance, lambdas);
    weight *= 0.25f / width;
#define C(c)                                                                                                   \
    {                                                                                                          \
        integer band = max_i(min_i(to_integer((lambdas.c - lo) / width), (integer)(count - 1)), (integer)(0)); \
        integer at = sel_i(m, 2 * (plane * count + band) * padded_pixels + pixel_index, (integer)(0));         \
        real sum = gather(bands, at), compensation = gather(bands, at + padded_pixels);                        \
        sum_add(&sum, &compensation, value.c * weight);                                                        \
        scatter_if(bands, at, m, sum);                                                                         \
        scatter_if(bands, at + padded_pixels, m, compensation);                                                \
    }
    SPECTRUM_EACH(C)
#undef C
}
