/* An environment of spectra: the directions of lights/kinds/envmap.cl, with `bands` values in every texel. Its texels
 * are chosen by their luminance and, a little, by all their light. */
#include "textures/band_texels.cl"

inline Envmap spectral_envmap_image(SpectralEnvmap l)
{
    return (Envmap){l.x, l.y, l.z, l.width, l.height, l.texels, l.corners, l.marginal, l.conditional, l.blocks,
                    l.block_rows, l.block_columns, l.norm};
}

inline Spectrum spectral_envmap_between(SpectralEnvmap l, Scene scene, integer row, integer column, vec2 at,
                                        Wavelengths lambdas)
{
    integer right = sel_i(column + 1 == l.width, (integer)(0), column + 1), left = row * l.width;
    integer below = left + l.width, texels[4] = {left + column, left + right, below + column, below + right};
    Spectrum numbers = spectra_row(scene, l.number, lambdas);
    return bands_lit(bands_between(scene, l.texels, l.bands, texels, at, numbers), l.bands, numbers);
}

Spectrum spectral_envmap_radiance(SpectralEnvmap l, Scene scene, vec3 d, Wavelengths lambdas)
{
    EnvmapPoint p = envmap_point(spectral_envmap_image(l), d);
    return spectral_envmap_between(l, scene, p.row, p.column, p.at, lambdas);
}

real spectral_envmap_pdf(SpectralEnvmap l, Scene scene, vec3 hemisphere, vec3 d)
{
    return envmap_pdf(spectral_envmap_image(l), scene, hemisphere, d);
}

LightSample spectral_envmap_sample(SpectralEnvmap l, Scene scene, vec3 hemisphere, vec2 u, Wavelengths lambdas)
{
    Envmap image = spectral_envmap_image(l);
    GridPoint g = grid_sample(scene, envmap_grid(image), envmap_receiver(image, hemisphere), u);
    LightSample s = envmap_direction(image, g);
    s.radiance = spectral_envmap_between(l, scene, g.row, g.column, g.at, lambdas);
    return s;
}
