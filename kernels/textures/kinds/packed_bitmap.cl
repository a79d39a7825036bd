/* An image of 8 bits a channel, placed on uv as in textures/kinds/bitmap.cl, in fewer bytes: a number takes 1, a
 * colour 4, or 8 as a spectrum (spectrum_packed_texel). `decode` is the first of the 256 values of bytes. All
 * four texels are read before the first is decoded, so that the processor waits for memory once. */
Spectrum packed_bitmap_reflectance(PackedBitmap t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    Bitmap image = BITMAP_OF(t);
    BitmapTexels b = bitmap_texels(image, scene, point);
    PackedTexel texels[4];
    real weights[4];
    int corners = bitmap_corners(b);
    UNROLLED
    for (int corner = 0; corner < 4 && corner < corners; corner++) {
        integer index = bitmap_corner(image, b, corner, &weights[corner]);
        texels[corner] = spectrum_packed_words(scene.images, t.first, index);
    }
    Spectrum sum = spectrum_of(0.0f);
    UNROLLED
    for (int corner = 0; corner < 4 && corner < corners; corner++) {
        Spectrum texel = spectrum_packed_texel(scene.images, texels[corner], t.decode, lambdas);
        sum = spectrum_madd(texel, weights[corner], sum);
    }
    return sum;
}

Spectrum packed_bitmap_texel(PackedBitmap t, Scene scene, TexturePoint point, vec2 u, Wavelengths lambdas)
{
    mask inside;
    Bitmap image = BITMAP_OF(t);
    integer index = bitmap_random(image, scene, point, u, &inside);
    PackedTexel texel = spectrum_packed_words(scene.images, t.first, index);
    Spectrum value = spectrum_packed_texel(scene.images, texel, t.decode, lambdas);
    return spectrum_sel(inside, value, spectrum_of(0.0f));
}

/* In RGB mode alone: light has no packed spectra. */
Spectrum packed_bitmap_emission(PackedBitmap t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return packed_bitmap_reflectance(t, scene, point, lambdas);
}

real packed_bitmap_real(PackedBitmap t, Scene scene, TexturePoint point)
{
    Bitmap image = BITMAP_OF(t);
    BitmapTexels b = bitmap_texels(image, scene, point);
    real sum = 0.0f;
    for (int corner = 0; corner < 4; corner++) {
        real weight;
        integer index = bitmap_corner(image, b, corner, &weight);
        if (!any(weight > 0.0f)) continue;
        integer word = gather_i(scene.images, t.first + (index >> 2));
        integer byte = (word >> ((index & 3) << 3)) & 255;
        sum += weight * gather_w(scene.images, t.decode + byte);
    }
    return sum;
}
