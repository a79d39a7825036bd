/* Images of spectra: a texel is `bands` values at ascending wavelengths, linear in between. Which band a
 * wavelength lies at is tabulated in a row of `spectra`: `numbers` holds its number at each wavelength of
 * the path, whole at a band, below 0 or above bands - 1 beyond the ends, where values stay as they are. */
inline Spectrum bands_texel(Scene scene, integer first, integer bands, Spectrum numbers)
{
    Spectrum r;
#define C(c)                                                                               \
    {                                                                                      \
        real x = clamp_r(numbers.c, (real)(0.0f), to_real(bands - 1));                     \
        integer i = max_i(min_i(to_integer(x), bands - 2), (integer)(0));                  \
        real a = gather(scene.texels, first + i), b = gather(scene.texels, first + i + 1); \
        r.c = a + (x - to_real(i)) * (b - a);                                              \
    }
    SPECTRUM_EACH(C)
#undef C
    return r;
}

/* Bilinear between four texels, at `at` between them. */
inline Spectrum bands_between(Scene scene, integer first, integer bands, integer texels[4], vec2 at, Spectrum numbers)
{
    Spectrum sum = spectrum_of(0.0f);
    for (int corner = 0; corner < 4; corner++) {
        real weight = ((corner & 1) ? at.x : 1.0f - at.x) * ((corner >> 1) ? at.y : 1.0f - at.y);
        sum = spectrum_madd(bands_texel(scene, first + bands * texels[corner], bands, numbers), weight, sum);
    }
    return sum;
}

/* The same where there is light at the bands' wavelengths only: dark beyond the ends. */
inline Spectrum bands_lit(Spectrum value, integer bands, Spectrum numbers)
{
    Spectrum r;
#define C(c) r.c = sel((numbers.c >= 0.0f) & (numbers.c <= to_real(bands - 1)), value.c, (real)(0.0f));
    SPECTRUM_EACH(C)
#undef C
    return r;
}
