/* A Spectrum in spectral mode: values at the path's four wavelengths, x at the hero's (Wilkie 2014). */
#define SPECTRUM_SIZE 4
typedef struct { real x, y, z, w; } Spectrum;
#define SPECTRUM_EACH(F) F(x) F(y) F(z) F(w)
#define SPECTRUM(x, y, z, w) ((Spectrum){x, y, z, w})
#define SPECTRUM_MAX(s) max_r(max_r(max_r((s).x, (s).y), (s).z), (s).w)
#define SPECTRUM_MEAN(s) (((s).x + (s).y + (s).z + (s).w) * 0.25f)
/* The value that directions or distances are sampled by: the hero's. */
inline real spectrum_pick(Spectrum s, Spectrum ratio, real u) { return s.x; }

/* Step read: spectra at a path's wavelengths, and from light to film. Tables lie on a grid of SPECTRA_STEP nm from
 * settings->lambda_min; row 0 is D65, then the sensor. */
typedef Spectrum Wavelengths;

/* Linear interpolation in row `row` of `spectra`. */
inline Spectrum spectra_row(Scene scene, integer row, Wavelengths lambdas)
{
    integer first = row * SPECTRA_SIZE;
    real lo = scene.settings->lambda_min;
    Spectrum r;
#define C(c)                                                                                                     \
    {                                                                                                            \
        real x = clamp_r((lambdas.c - lo) * (1.0f / SPECTRA_STEP), (real)(0.0f), (real)(SPECTRA_SIZE - 1.001f)); \
        integer i = to_integer(x);                                                                               \
        real a = gather(scene.spectra, first + i), b = gather(scene.spectra, first + i + 1);                     \
        r.c = a + (x - to_real(i)) * (b - a);                                                                    \
    }
    SPECTRUM_EACH(C)
#undef C
    return r;
}
/* Jakob and Hanika 2019 eq. 5: w (1/2 + x / (2 sqrt(1 + x^2))), x = (c0 lambda + c1) lambda + c2. */
inline Spectrum sigmoid_spectrum(real c0, real c1, real c2, real w, Wavelengths lambdas)
{
    Spectrum r;
#define C(c)                                              \
    {                                                     \
        real x = (c0 * lambdas.c + c1) * lambdas.c + c2;  \
        r.c = w * (0.5f + 0.5f * x / sqrt(1.0f + x * x)); \
    }
    SPECTRUM_EACH(C)
#undef C
    return r;
}
/* A value that stands in the row itself: sigmoid coefficients and a factor. */
inline Spectrum spectrum_constant(vec4 words, Wavelengths lambdas)
{
    return sigmoid_spectrum(words.x, words.y, words.z, words.w, lambdas);
}
/* Whether it is 0, whatever the wavelength. */
inline mask spectrum_constant_none(vec4 words) { return words.w == 0.0f; }
/* The same of a value without colour: the factor alone. */
inline Spectrum spectrum_grey(vec4 words) { return spectrum_of(words.w); }
/* A tabulated spectrum: the fifth word, its source, is -1 - its row, the fourth a factor. */
inline Spectrum spectrum_table(Scene scene, vec4 words, integer source, Wavelengths lambdas)
{
    return spectrum_scale(spectra_row(scene, max_i(-1 - source, (integer)(0)), lambdas), words.w);
}
/* What a texel of a bitmap means: sigmoid coefficients and a factor. */
inline Spectrum spectrum_texel(real x, real y, real z, real w, Wavelengths lambdas)
{
    return sigmoid_spectrum(x, y, z, w, lambdas);
}
/* A texel of an emission image or environment map: the same, times D65. */
inline Spectrum spectrum_light_texel(Scene scene, real x, real y, real z, real w, Wavelengths lambdas)
{
    return spectrum_mul(sigmoid_spectrum(x, y, z, w, lambdas), spectra_row(scene, (integer)(0), lambdas));
}
/* The same for a texel of four floats in a table. */
inline Spectrum spectrum_texel_at(global const uint *table, integer at, Wavelengths lambdas)
{
    return spectrum_constant(gather_w4(table, at), lambdas);
}
inline Spectrum spectrum_light_texel_at(Scene scene, global const uint *table, integer at, Wavelengths lambdas)
{
    return spectrum_mul(spectrum_constant(gather_w4(table, at), lambdas), spectra_row(scene, (integer)(0), lambdas));
}
/* Light of a grey: D65. */
inline Spectrum spectrum_grey_light(Scene scene, real value, Wavelengths lambdas)
{
    return spectrum_scale(spectra_row(scene, (integer)(0), lambdas), value);
}
/* And for a texel of two words: a sigmoid's argument at 400, 550 and 700 nm, as floats of 21 bits, two in
 * the words' upper bits, the third in the lower bits. In between it is the parabola through them. */
typedef struct { integer p, q; } PackedTexel;
inline PackedTexel spectrum_packed_words(global const uint *table, integer first, integer index)
{
    integer at = first + 2 * index;
    return (PackedTexel){gather_i(table, at), gather_i(table, at + 1)};
}
inline Spectrum spectrum_packed_texel(global const uint *table, PackedTexel t, integer decode, Wavelengths lambdas)
{
    real a = as_real(t.p & ~0x7ff), b = as_real(t.q & ~0x7ff);
    real c = as_real(((t.p & 0x7ff) << 21) | ((t.q & 0x3ff) << 11));
    Spectrum r;
#define C(c_)                                                                         \
    {                                                                                 \
        real u = (lambdas.c_ - 400.0f) * (1.0f / 150.0f), v = u - 1.0f, w = u - 2.0f; \
        real x = 0.5f * (a * v * w + c * u * v) - b * u * w;                          \
        r.c_ = 0.5f + 0.5f * x / sqrt(1.0f + x * x);                                  \
    }
    SPECTRUM_EACH(C)
#undef C
    return r;
}
