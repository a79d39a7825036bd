/* An image with a spectrum in every texel, placed on uv as in textures/kinds/bitmap.cl. A reflectance
 * goes on beyond its first and last band as it is there, light ends. */
#include "textures/band_texels.cl"

inline Spectrum spectral_bitmap_at(SpectralBitmap t, Scene scene, TexturePoint point, Spectrum numbers)
{
    Bitmap image = BITMAP_OF(t);
    BitmapTexels b = bitmap_texels(image, scene, point);
    Spectrum sum = spectrum_of(0.0f);
    for (int corner = 0; corner < 4; corner++) {
        real weight;
        integer at = t.first + t.bands * bitmap_corner(image, b, corner, &weight);
        sum = spectrum_madd(bands_texel(scene, at, t.bands, numbers), weight, sum);
    }
    return sum;
}

Spectrum spectral_bitmap_texel(SpectralBitmap t, Scene scene, TexturePoint point, vec2 u, Wavelengths lambdas)
{
    mask inside;
    Bitmap image = BITMAP_OF(t);
    integer at = t.first + t.bands * bitmap_random(image, scene, point, u, &inside);
    Spectrum value = bands_texel(scene, at, t.bands, spectra_row(scene, t.number, lambdas));
    return spectrum_sel(inside, value, spectrum_of(0.0f));
}

Spectrum spectral_bitmap_reflectance(SpectralBitmap t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return spectral_bitmap_at(t, scene, point, spectra_row(scene, t.number, lambdas));
}

Spectrum spectral_bitmap_emission(SpectralBitmap t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    Spectrum numbers = spectra_row(scene, t.number, lambdas);
    return bands_lit(spectral_bitmap_at(t, scene, point, numbers), t.bands, numbers);
}
