/* Numbers that vary in space: sums of Perlin's noise (2002) as pbrt has them. fbm sums octaves, each 1.99
 * times as fine and `roughness` as strong; wrinkled sums their absolute values; windy is a height of waves
 * times the strength of gusts. All octaves are summed: samples of a pixel average what is finer than it. */
#include "core/perlin_noise.cl"

inline real noise_value(Noise t, Scene scene, TexturePoint point)
{
    vec3 p = texture_transformed(scene, t.transform, point.p);
    mask windy = t.pattern == NOISE_PATTERN_WINDY, wrinkled = t.pattern == NOISE_PATTERN_WRINKLED;
    real value = fractal_noise(scene, p, sel_i(windy, (integer)(6), t.octaves), sel(windy, (real)(0.5f), t.roughness),
                               wrinkled);
    if (any(windy)) {
        real gusts = fractal_noise(scene, scale3(p, 0.1f), (integer)(3), (real)(0.5f), mask_of(0));
        value = sel(windy, fabs(gusts) * value, value);
    }
    return value;
}

Spectrum noise_reflectance(Noise t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return spectrum_clamped(spectrum_of(noise_value(t, scene, point)));
}

Spectrum noise_emission(Noise t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return spectrum_grey_light(scene, max_r(noise_value(t, scene, point), (real)(0.0f)), lambdas);
}

real noise_real(Noise t, Scene scene, TexturePoint point) { return noise_value(t, scene, point); }
