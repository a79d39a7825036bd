/* Wavelengths by visible importance: pdf proportional to sech^2(0.0072 (lambda - 538)), cut to where
 * the sensor responds (Radziszewski et al. 2009; pbrt-v4's constants). Same functions in
 * spectra/density.cl. */
#include "generated/importance.cl"
inline Wavelengths wavelengths_sample(Scene scene, real u)
{
    real a = scene.settings->tanh_min, b = scene.settings->tanh_max, offset = 0.0f;
    Wavelengths r;
#define C(c)                                                                                   \
    {                                                                                          \
        real v = u + offset;                                                                   \
        real t = clamp_r(a + (v - floor(v)) * (b - a), (real)(-0.999999f), (real)(0.999999f)); \
        r.c = IMPORTANCE_PEAK + log_r((1.0f + t) / (1.0f - t)) * (0.5f / IMPORTANCE_SLOPE);    \
        offset += 0.25f;                                                                       \
    }
    SPECTRUM_EACH(C)
#undef C
    return r;
}
/* What a sample adds to a pixel: XYZ; rows 1 to 3 hold the sensor's curves over the pdf. */
inline vec3 film_value(Scene scene, Spectrum radiance, Wavelengths lambdas)
{
    return v3(spectrum_mean(spectrum_mul(radiance, spectra_row(scene, (integer)(1), lambdas))),
              spectrum_mean(spectrum_mul(radiance, spectra_row(scene, (integer)(2), lambdas))),
              spectrum_mean(spectrum_mul(radiance, spectra_row(scene, (integer)(3), lambdas))));
}
