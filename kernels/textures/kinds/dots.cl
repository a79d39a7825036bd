/* 1 within round dots, 0 elsewhere, as pbrt's dots: of the cells of uv around whole numbers half have
 * a dot of radius 0.35, put somewhere in it by noise. */
#include "core/perlin_noise.cl"

inline real dots_value(Dots t, Scene scene, TexturePoint point)
{
    vec3 p = texture_uv(scene, t.mapping, t.transform, point);
    real u = dot3(t.to_u, p), v = dot3(t.to_v, p), i = floor(u + 0.5f), j = floor(v + 0.5f);
    mask has = perlin_noise(scene, v3(i + 0.5f, j + 0.5f, (real)(0.5f))) > 0.0f;
    real x = u - (i + 0.15f * perlin_noise(scene, v3(i + 1.5f, j + 2.8f, (real)(0.5f))));
    real y = v - (j + 0.15f * perlin_noise(scene, v3(i + 4.5f, j + 9.8f, (real)(0.5f))));
    return sel(has & (x * x + y * y < 0.35f * 0.35f), (real)(1.0f), (real)(0.0f));
}

Spectrum dots_reflectance(Dots t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return spectrum_of(dots_value(t, scene, point));
}

Spectrum dots_emission(Dots t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return spectrum_grey_light(scene, dots_value(t, scene, point), lambdas);
}

real dots_real(Dots t, Scene scene, TexturePoint point) { return dots_value(t, scene, point); }
