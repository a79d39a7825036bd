/* An image on the unit square of uv: texel centres at (i + 1/2) / size, as in Mitsuba's bitmap. Row 0
 * lies at v = 0 of the transformed uv; the host has turned v round. Between texels the evaluated
 * values are interpolated, not the coefficients of their spectra. */

/* The image of a texture with the same members. */
#define BITMAP_OF(t) \
    {t.kind, t.to_u, t.to_v, t.mapping, t.transform, t.width, t.height, t.first, t.filter, t.wrap_u, t.wrap_v, t.decode}

typedef struct {
    integer x0, x1, y0, y1; /* columns and rows of the four texels, inside the image */
    real u0, u1, v0, v1;    /* their weights */
} BitmapTexels;

inline integer bitmap_wrap(integer i, integer size, integer wrap)
{
    integer repeated = sel_i(i < 0, i + size, sel_i(i >= size, i - size, i));
    integer mirrored = sel_i(i >= size, 2 * size - 1 - i, i);
    i = sel_i(wrap == BITMAP_WRAP_REPEAT, repeated, sel_i(wrap == BITMAP_WRAP_MIRROR, mirrored, i));
    return min_i(max_i(i, (integer)(0)), size - 1);
}

/* A coordinate in the first period, or near the image, even for huge coordinates and NaN. */
inline real bitmap_coordinate(real x, integer wrap)
{
    mask ends = wrap == BITMAP_WRAP_ZERO;
    real period = sel(wrap == BITMAP_WRAP_MIRROR, (real)(2.0f), (real)(1.0f)), turns = x / period;
    x = sel((wrap == BITMAP_WRAP_CLAMP) | ends, x, (turns - floor(turns)) * period);
    return clamp_r(x, sel(ends, (real)(-1.0f), (real)(0.0f)), sel(ends, (real)(2.0f), period));
}

/* Along an axis: two texels, and their weights; what lies outside weighs nothing where the wrap is zero. */
inline void bitmap_axis(real x, integer size, integer wrap, mask smooth, integer *i0, integer *i1, real *w0, real *w1)
{
    mask ends = wrap == BITMAP_WRAP_ZERO;
    x = bitmap_coordinate(x, wrap) * to_real(size) - sel(smooth, (real)(0.5f), (real)(0.0f));
    real below = floor(x), t = sel(smooth, x - below, (real)(0.0f));
    integer first = to_integer(below), second = first + 1;
    *w0 = sel(ends & ((first < 0) | (first >= size)), (real)(0.0f), 1.0f - t);
    *w1 = sel(ends & ((second < 0) | (second >= size)), (real)(0.0f), t);
    *i0 = bitmap_wrap(first, size, wrap);
    *i1 = bitmap_wrap(second, size, wrap);
}

/* Along an axis: a random texel of the two, with its weight as its probability; u: uniform. It leaves `inside` where
 * the outside has weight 0. */
inline integer bitmap_axis_texel(real x, integer size, integer wrap, mask smooth, real u, mask *inside)
{
    x = bitmap_coordinate(x, wrap) * to_real(size) + sel(smooth, u - 0.5f, (real)(0.0f));
    integer i = to_integer(floor(x));
    *inside = *inside & !((wrap == BITMAP_WRAP_ZERO) & ((i < 0) | (i >= size)));
    return bitmap_wrap(i, size, wrap);
}

inline BitmapTexels bitmap_texels(Bitmap t, Scene scene, TexturePoint point)
{
    vec3 p = texture_uv(scene, t.mapping, t.transform, point);
    mask smooth = t.filter == BITMAP_FILTER_BILINEAR;
    BitmapTexels b;
    bitmap_axis(dot3(t.to_u, p), t.width, t.wrap_u, smooth, &b.x0, &b.x1, &b.u0, &b.u1);
    bitmap_axis(dot3(t.to_v, p), t.height, t.wrap_v, smooth, &b.y0, &b.y1, &b.v0, &b.v1);
    return b;
}

/* How many of the four texels have weight in some lane: all, or the first. */
inline int bitmap_corners(BitmapTexels b) { return any((b.u1 > 0.0f) | (b.v1 > 0.0f)) ? 4 : 1; }
/* A random texel of the four: its index in the image, and its weight. */
inline integer bitmap_corner(Bitmap t, BitmapTexels b, int corner, real *weight)
{
    int right = corner & 1, next = corner >> 1;
    *weight = (right ? b.u1 : b.u0) * (next ? b.v1 : b.v0);
    return (next ? b.y1 : b.y0) * t.width + (right ? b.x1 : b.x0);
}

/* A texel at random: its index in the image. */
inline integer bitmap_random(Bitmap t, Scene scene, TexturePoint point, vec2 u, mask *inside)
{
    vec3 p = texture_uv(scene, t.mapping, t.transform, point);
    mask smooth = t.filter == BITMAP_FILTER_BILINEAR;
    *inside = mask_of(1);
    integer x = bitmap_axis_texel(dot3(t.to_u, p), t.width, t.wrap_u, smooth, u.x, inside);
    integer y = bitmap_axis_texel(dot3(t.to_v, p), t.height, t.wrap_v, smooth, u.y, inside);
    return y * t.width + x;
}

Spectrum bitmap_texel(Bitmap t, Scene scene, TexturePoint point, vec2 u, Wavelengths lambdas)
{
    mask inside;
    integer at = t.first + SPECTRUM_SIZE * bitmap_random(t, scene, point, u, &inside);
    return spectrum_sel(inside, spectrum_texel_at(scene.images, at, lambdas), spectrum_of(0.0f));
}

/* light: whether the texels are emission. */
inline Spectrum bitmap_spectrum(Bitmap t, Scene scene, TexturePoint point, int light, Wavelengths lambdas)
{
    BitmapTexels b = bitmap_texels(t, scene, point);
    Spectrum sum = spectrum_of(0.0f);
    for (int corner = 0; corner < 4; corner++) {
        real weight;
        integer at = t.first + SPECTRUM_SIZE * bitmap_corner(t, b, corner, &weight);
        if (!any(weight > 0.0f)) continue;
        Spectrum texel = light ? spectrum_light_texel_at(scene, scene.images, at, lambdas)
                               : spectrum_texel_at(scene.images, at, lambdas);
        sum = spectrum_madd(texel, weight, sum);
    }
    return sum;
}

Spectrum bitmap_reflectance(Bitmap t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return bitmap_spectrum(t, scene, point, 0, lambdas);
}

Spectrum bitmap_emission(Bitmap t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return bitmap_spectrum(t, scene, point, 1, lambdas);
}

real bitmap_real(Bitmap t, Scene scene, TexturePoint point)
{
    BitmapTexels b = bitmap_texels(t, scene, point);
    real sum = 0.0f;
    for (int corner = 0; corner < 4; corner++) {
        real weight;
        integer at = t.first + bitmap_corner(t, b, corner, &weight);
        if (!any(weight > 0.0f)) continue;
        sum += weight * gather_w(scene.images, at);
    }
    return sum;
}
