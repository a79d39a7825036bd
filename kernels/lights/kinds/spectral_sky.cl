/* A sky of spectra: the directions of lights/kinds/sky.cl, with `bands` values in every texel. */
#include "textures/band_texels.cl"

inline Sky spectral_sky_image(SpectralSky l)
{
    return (Sky){l.x, l.y, l.z, l.width, l.height, l.texels, l.corners, l.marginal, l.conditional, l.blocks,
                 l.block_rows, l.block_columns, l.norm, l.horizon, l.sun_texels, l.sun_cos, l.sun_sin, l.sun_radius,
                 l.sun_share};
}

inline Spectrum spectral_sky_between(SpectralSky l, Scene scene, integer first, SkyTexels t, Spectrum numbers)
{
    integer texels[4] = {t.i00, t.i10, t.i01, t.i11};
    return bands_between(scene, first, l.bands, texels, t.at, numbers);
}

inline Spectrum spectral_sky_of(SpectralSky l, Scene scene, SkyPoint p, mask disc, SkyTexels sun, Wavelengths lambdas)
{
    Spectrum numbers = spectra_row(scene, l.number, lambdas);
    Spectrum sum = spectral_sky_between(l, scene, l.texels, sky_texels(spectral_sky_image(l), p), numbers);
    mask shines = disc & p.up;
    if (any(shines)) {
        Spectrum s = spectral_sky_between(l, scene, l.sun_texels, sun, numbers);
        sum = spectrum_madd(s, sel(shines, (real)(1.0f), (real)(0.0f)), sum);
    }
    return bands_lit(sum, l.bands, numbers);
}

Spectrum spectral_sky_radiance(SpectralSky l, Scene scene, vec3 d, Wavelengths lambdas)
{
    Sky image = spectral_sky_image(l);
    SkyTexels sun;
    mask disc = sky_disc(image, d, &sun);
    return spectral_sky_of(l, scene, sky_point(image, d), disc, sun, lambdas);
}

real spectral_sky_pdf(SpectralSky l, Scene scene, vec3 hemisphere, vec3 d)
{
    return sky_pdf(spectral_sky_image(l), scene, hemisphere, d);
}

LightSample spectral_sky_sample(SpectralSky l, Scene scene, vec3 hemisphere, vec2 u, Wavelengths lambdas)
{
    Sky image = spectral_sky_image(l);
    LightSample s;
    SkyTexels sun;
    s.wi = sky_direction(image, scene, hemisphere, u);
    s.t = FAR;
    SkyPoint p = sky_point(image, s.wi);
    mask disc = sky_disc(image, s.wi, &sun);
    s.radiance = spectral_sky_of(l, scene, p, disc, sun, lambdas);
    s.pdf = sky_density(image, scene, hemisphere, s.wi, p, disc);
    return s;
}
