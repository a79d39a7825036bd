/* An image with levels (textures/mip_levels.cl), each placed and filtered as in textures/kinds/bitmap.cl. */
#include "textures/mip_levels.cl"

inline Bitmap mip_bitmap_level(MipBitmap t, Scene scene, integer level)
{
    Bitmap b = BITMAP_OF(t);
    return mip_level(b, scene, t.table, level);
}

inline MipLevels mip_bitmap_levels(MipBitmap t, TexturePoint point)
{
    return mip_levels(point, t.to_u, t.to_v, t.mapping, to_real(t.width) * to_real(t.height), t.levels);
}

Spectrum mip_bitmap_reflectance(MipBitmap t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    MipLevels found = mip_bitmap_levels(t, point);
    Spectrum value = bitmap_reflectance(mip_bitmap_level(t, scene, found.level), scene, point, lambdas);
    mask between = found.coarser > 0.0f;
    if (any(between)) {
        integer next = found.level + sel_i(between, (integer)(1), (integer)(0));
        Spectrum coarser = bitmap_reflectance(mip_bitmap_level(t, scene, next), scene, point, lambdas);
        Spectrum mixed = spectrum_madd(coarser, found.coarser, spectrum_scale(value, 1.0f - found.coarser));
        value = spectrum_sel(between, mixed, value);
    }
    return value;
}

Spectrum mip_bitmap_texel(MipBitmap t, Scene scene, TexturePoint point, vec2 u, Wavelengths lambdas)
{
    integer level = mip_random(mip_bitmap_levels(t, point), &u.x);
    return bitmap_texel(mip_bitmap_level(t, scene, level), scene, point, u, lambdas);
}

/* Lights are sampled as their images are. */
Spectrum mip_bitmap_emission(MipBitmap t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return bitmap_emission(mip_bitmap_level(t, scene, (integer)(0)), scene, point, lambdas);
}

real mip_bitmap_real(MipBitmap t, Scene scene, TexturePoint point)
{
    MipLevels found = mip_bitmap_levels(t, point);
    real value = bitmap_real(mip_bitmap_level(t, scene, found.level), scene, point);
    mask between = found.coarser > 0.0f;
    if (any(between)) {
        integer next = found.level + sel_i(between, (integer)(1), (integer)(0));
        real coarser = bitmap_real(mip_bitmap_level(t, scene, next), scene, point);
        value = sel(between, value + found.coarser * (coarser - value), value);
    }
    return value;
}
