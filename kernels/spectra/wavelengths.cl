/* Wavelengths of paths: how the camera draws them, and what a sample adds to a pixel. */

/* Step visible: by visible importance: pdf proportional to sech^2(0.0072 (lambda - 538)), cut to where
 * the sensor responds (Radziszewski et al. 2009; pbrt-v4's constants). */
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

/* Step density: by a tabulated density, linear between nodes of equal distance (clpt/render/spectra/find.py). At
 * settings->density in `distributions`: the number of cells n, the first node and the distance [nm], n + 1 cumulative
 * shares, n + 1 densities [1/nm], and for i from 0 to DENSITY_GUIDES the cell that holds the share i / DENSITY_GUIDES.
 * */
#include "generated/density_sizes.cl"

/* The wavelength below which a share u of the density lies [nm]. */
inline real density_invert(Scene scene, real u)
{
    int head = scene.settings->density, n = (int)scene.distributions[head], sums = head + 3, values = sums + n + 1;
    integer cell = min_i(to_integer(u * (float)DENSITY_GUIDES), (integer)(DENSITY_GUIDES - 1));
    integer guide = max_i(cell, (integer)(0)) + (values + n + 1);
    integer low = to_integer(gather(scene.distributions, guide));
    integer high = to_integer(gather(scene.distributions, guide + 1)) + 1;
    while (any((high - low) > 1)) {
        integer middle = (low + high) >> 1;
        mask below = gather(scene.distributions, middle + sums) <= u;
        low = sel_i(below, middle, low);
        high = sel_i(below, high, middle);
    }
    real first = gather(scene.distributions, low + sums), last = gather(scene.distributions, low + (sums + 1));
    real a = gather(scene.distributions, low + values), b = gather(scene.distributions, low + (values + 1));
    real v = clamp_r((u - first) / max_r(last - first, (real)(1e-12f)), (real)(0.0f), (real)(1.0f));
    /* The share of a cell up to t is (a t + (b - a) t^2 / 2) / ((a + b) / 2), solved without cancellation. */
    real t = v * (a + b) / max_r(a + sqrt(a * a + v * (b * b - a * a)), (real)(1e-30f));
    return scene.distributions[head + 1] + scene.distributions[head + 2] * (to_real(low) + min_r(t, (real)(1.0f)));
}
/* The density at a wavelength [1/nm]. */
inline real density_pdf(Scene scene, real lambda)
{
    int head = scene.settings->density, n = (int)scene.distributions[head], values = head + n + 4;
    real x = (lambda - scene.distributions[head + 1]) / scene.distributions[head + 2];
    integer i = max_i(min_i(to_integer(x), (integer)(n - 1)), (integer)(0));
    real a = gather(scene.distributions, i + values), b = gather(scene.distributions, i + (values + 1));
    return max_r(a + (x - to_real(i)) * (b - a), (real)(1e-12f));
}
inline Wavelengths wavelengths_sample(Scene scene, real u)
{
    real offset = 0.0f;
    Wavelengths r;
#define C(c)                                       \
    {                                              \
        real v = u + offset;                       \
        r.c = density_invert(scene, v - floor(v)); \
        offset += 0.25f;                           \
    }
    SPECTRUM_EACH(C)
#undef C
    return r;
}
/* Radiance over the density, at each of the wavelengths. */
inline Spectrum wavelengths_weigh(Scene scene, Spectrum radiance, Wavelengths lambdas)
{
    Spectrum r;
#define C(c) r.c = radiance.c / density_pdf(scene, lambdas.c);
    SPECTRUM_EACH(C)
#undef C
    return r;
}
/* What a sample adds to a pixel; rows 1 to 3 hold the sensor's curves. */
inline vec3 film_value(Scene scene, Spectrum radiance, Wavelengths lambdas)
{
    Spectrum weighed = wavelengths_weigh(scene, radiance, lambdas);
    return v3(spectrum_mean(spectrum_mul(weighed, spectra_row(scene, (integer)(1), lambdas))),
              spectrum_mean(spectrum_mul(weighed, spectra_row(scene, (integer)(2), lambdas))),
              spectrum_mean(spectrum_mul(weighed, spectra_row(scene, (integer)(3), lambdas))));
}

/* Step seen: the wavelengths of a path as the film sees them, where it fluoresces; lambdas: of the light that comes. */
inline Wavelengths seen_wavelengths(Scene scene, Slab path, uint at, Wavelengths lambdas)
{
    Sampler begun = pixel_sampler(scene.settings, load_path_pixel_key(path, at), load_path_sample(path, at));
    return wavelengths_sample(scene, sampler_pair(begun, (natural)(DIMENSION_WAVELENGTH)).x);
}

/* Twin, where nothing fluoresces. */
inline Wavelengths seen_wavelengths(Scene scene, Slab path, uint at, Wavelengths lambdas) { return lambdas; }
