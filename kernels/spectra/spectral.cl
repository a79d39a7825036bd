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
/* The spectrum of a computed colour (Jakob and Hanika 2019), as clpt/spectra/upsampling.py looks it up. `table` is the
 * first float in `texels` of 40 values of the largest component, 40 ratios of the others to it, and rows of three
 * coefficients by the largest component, its value and the two ratios. */
#define UPLIFT_NODES 40
inline integer uplift_cell(Scene scene, integer nodes, real x, real *t)
{
    integer low = 0;
    for (int step = 32; step > 0; step >>= 1) {
        integer next = min_i(low + step, (integer)(UPLIFT_NODES - 2));
        low = sel_i(x >= gather(scene.texels, nodes + next), next, low);
    }
    real a = gather(scene.texels, nodes + low), b = gather(scene.texels, nodes + low + 1);
    *t = clamp_r((x - a) / (b - a), (real)(0.0f), (real)(1.0f));
    return low;
}
/* Three coefficients over (lambda - 595 nm) / 235 nm, of a colour in [0, 1]. */
inline vec3 uplifted(Scene scene, integer table, vec3 rgb)
{
    mask blue = (rgb.z > rgb.x) & (rgb.z > rgb.y), green = !blue & (rgb.y > rgb.x);
    real value = sel(blue, rgb.z, sel(green, rgb.y, rgb.x)), t, u, v;
    real first = sel(blue, rgb.x, sel(green, rgb.z, rgb.y)), second = sel(blue, rgb.y, sel(green, rgb.x, rgb.z));
    real over = 1.0f / max_r(value, (real)(1e-30f));
    first = sel(value > 0.0f, first * over, (real)(1.0f));
    second = sel(value > 0.0f, second * over, (real)(1.0f));
    integer row = sel_i(blue, (integer)(2), sel_i(green, (integer)(1), (integer)(0)));
    row = row * UPLIFT_NODES + uplift_cell(scene, table, value, &t);
    row = row * UPLIFT_NODES + uplift_cell(scene, table + UPLIFT_NODES, first, &u);
    row = row * UPLIFT_NODES + uplift_cell(scene, table + UPLIFT_NODES, second, &v);
    vec3 sum = v3(0.0f, 0.0f, 0.0f);
    for (int corner = 0; corner < 8; corner++) {
        int i = corner & 1, j = (corner >> 1) & 1, k = corner >> 2;
        integer at = row + (i * UPLIFT_NODES + j) * UPLIFT_NODES + k;
        real weight = (i ? t : 1.0f - t) * (j ? u : 1.0f - u) * (k ? v : 1.0f - v);
        sum = madd3(gather3(scene.texels, table + 2 * UPLIFT_NODES + 3 * at), weight, sum);
    }
    real mean = (rgb.x + rgb.y + rgb.z) * (1.0f / 3.0f);
    real over_shrinkage = 1.0f / sqrt(max_r(mean * (1.0f - mean), (real)(1e-9f)));
    mask grey = (first == 1.0f) & (second == 1.0f);
    sum = sel3(grey, v3((real)(0.0f), (real)(0.0f), value - 0.5f), sum);
    return scale3(sum, over_shrinkage);
}
/* bounded: a reflectance, in [0, 1]; else twice the largest component times a reflectance. */
inline Spectrum spectrum_colour(Scene scene, integer table, vec3 rgb, mask bounded, Wavelengths lambdas)
{
    rgb = v3(max_r(rgb.x, (real)(0.0f)), max_r(rgb.y, (real)(0.0f)), max_r(rgb.z, (real)(0.0f)));
    real most = max_r(max_r(rgb.x, rgb.y), rgb.z), scale = sel(bounded, (real)(1.0f), 2.0f * most);
    vec3 shape = scale3(rgb, 1.0f / max_r(scale, (real)(1e-30f)));
    vec3 c = uplifted(scene, table, v3(min_r(shape.x, (real)(1.0f)), min_r(shape.y, (real)(1.0f)),
                                       min_r(shape.z, (real)(1.0f))));
    Spectrum r;
#define C(c_)                                                     \
    {                                                             \
        real u = (lambdas.c_ - 595.0f) * (1.0f / 235.0f);         \
        real x = (c.x * u + c.y) * u + c.z;                       \
        r.c_ = scale * (0.5f + 0.5f * x / sqrt(1.0f + x * x));    \
    }
    SPECTRUM_EACH(C)
#undef C
    return r;
}
