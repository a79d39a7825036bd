/* An image of bytes with levels (textures/mip_levels.cl), each as in textures/kinds/packed_bitmap.cl. */
#include "textures/mip_levels.cl"

inline PackedBitmap packed_mip_bitmap_level(PackedMipBitmap t, Scene scene, integer level)
{
    Bitmap b = BITMAP_OF(t);
    b = mip_level(b, scene, t.table, level);
    PackedBitmap p = BITMAP_OF(b);
    return p;
}

inline MipLevels packed_mip_bitmap_levels(PackedMipBitmap t, TexturePoint point)
{
    return mip_levels(point, t.to_u, t.to_v, t.mapping, to_real(t.width) * to_real(t.height), t.levels);
}

Spectrum packed_mip_bitmap_reflectance(PackedMipBitmap t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    MipLevels found = packed_mip_bitmap_levels(t, point);
    Spectrum value = packed_bitmap_reflectance(packed_mip_bitmap_level(t, scene, found.level), scene, point, lambdas);
    mask between = found.coarser > 0.0f;
    if (any(between)) {
        integer next = found.level + sel_i(between, (integer)(1), (integer)(0));
        Spectrum coarser = packed_bitmap_reflectance(packed_mip_bitmap_level(t, scene, next), scene, point, lambdas);
        Spectrum mixed = spectrum_madd(coarser, found.coarser, spectrum_scale(value, 1.0f - found.coarser));
        value = spectrum_sel(between, mixed, value);
    }
    return value;
}

Spectrum packed_mip_bitmap_texel(PackedMipBitmap t, Scene scene, TexturePoint point, vec2 u, Wavelengths lambdas)
{
    integer level = mip_random(packed_mip_bitmap_levels(t, point), &u.x);
    return packed_bitmap_texel(packed_mip_bitmap_level(t, scene, level), scene, point, u, lambdas);
}

/* Lights are sampled as their images are. */
Spectrum packed_mip_bitmap_emission(PackedMipBitmap t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return packed_bitmap_emission(packed_mip_bitmap_level(t, scene, (integer)(0)), scene, point, lambdas);
}

real packed_mip_bitmap_real(PackedMipBitmap t, Scene scene, TexturePoint point)
{
    MipLevels found = packed_mip_bitmap_levels(t, point);
    real value = packed_bitmap_real(packed_mip_bitmap_level(t, scene, found.level), scene, point);
    mask between = found.coarser > 0.0f;
    if (any(between)) {
        integer next = found.level + sel_i(between, (integer)(1), (integer)(0));
        real coarser = packed_bitmap_real(packed_mip_bitmap_level(t, scene, next), scene, point);
        value = sel(between, value + found.coarser * (coarser - value), value);
    }
    return value;
}
