/* A Spectrum in RGB mode: linear Rec. 709. spectra/spectral.cl has the same functions. */
#define SPECTRUM_SIZE 3
typedef struct { real x, y, z; } Spectrum;
#define SPECTRUM_EACH(F) F(x) F(y) F(z)
#define SPECTRUM(x, y, z, w) ((Spectrum){x, y, z})
#define SPECTRUM_MAX(s) max_r(max_r((s).x, (s).y), (s).z)
#define SPECTRUM_MEAN(s) (((s).x + (s).y + (s).z) * (1.0f / 3.0f))
/* The value that directions or distances are sampled by: a channel's, chosen by the parts of `ratio`; u in [0, 1). */
inline real spectrum_pick(Spectrum s, Spectrum ratio, real u)
{
    return sel(u * 3.0f < ratio.x, s.x, sel(u * 3.0f < ratio.x + ratio.y, s.y, s.z));
}

/* Step read: spectra from tables, and from light to film. */
typedef Spectrum Wavelengths;

/* A value that stands in the row itself: linear rgb. */
inline Spectrum spectrum_constant(vec4 words, Wavelengths lambdas) { return (Spectrum){words.x, words.y, words.z}; }
/* Whether it is 0, whatever the wavelength. */
inline mask spectrum_constant_none(vec4 words) { return (words.x == 0.0f) & (words.y == 0.0f) & (words.z == 0.0f); }
/* The same of a value without colour. */
inline Spectrum spectrum_grey(vec4 words) { return spectrum_of(words.x); }
/* Tabulated spectra were turned to rgb on the host. */
inline Spectrum spectrum_table(Scene scene, vec4 words, integer source, Wavelengths lambdas)
{
    return spectrum_constant(words, lambdas);
}
/* What a texel of a bitmap means: linear rgb. */
inline Spectrum spectrum_texel(real x, real y, real z, real w, Wavelengths lambdas) { return (Spectrum){x, y, z}; }
/* A texel of an emission image or environment map: linear rgb. */
inline Spectrum spectrum_light_texel(Scene scene, real x, real y, real z, real w, Wavelengths lambdas)
{
    return (Spectrum){x, y, z};
}
/* The same for a texel of three floats in a table. */
inline Spectrum spectrum_texel_at(global const uint *table, integer at, Wavelengths lambdas)
{
    vec3 rgb = gather3((global const float *)table, at);
    return (Spectrum){rgb.x, rgb.y, rgb.z};
}
inline Spectrum spectrum_light_texel_at(Scene scene, global const uint *table, integer at, Wavelengths lambdas)
{
    return spectrum_texel_at(table, at, lambdas);
}
/* And for a texel that takes a word: a byte a channel, whose meaning stands in 256 words from `decode`. */
typedef struct { integer rgb; } PackedTexel;
inline PackedTexel spectrum_packed_words(global const uint *table, integer first, integer index)
{
    return (PackedTexel){gather_i(table, first + index)};
}
inline Spectrum spectrum_packed_texel(global const uint *table, PackedTexel t, integer decode, Wavelengths lambdas)
{
    return (Spectrum){gather_w(table, decode + (t.rgb & 255)), gather_w(table, decode + ((t.rgb >> 8) & 255)),
                      gather_w(table, decode + ((t.rgb >> 16) & 255))};
}
/* Light of a grey: as bright in all channels. */
inline Spectrum spectrum_grey_light(Scene scene, real value, Wavelengths lambdas) { return spectrum_of(value); }
/* A computed colour, in [0, 1] where `bounded`; `table` is of spectra/spectral.cl. */
inline Spectrum spectrum_colour(Scene scene, integer table, vec3 rgb, mask bounded, Wavelengths lambdas)
{
    real most = sel(bounded, (real)(1.0f), (real)(FAR));
    return (Spectrum){clamp_r(rgb.x, (real)(0.0f), most), clamp_r(rgb.y, (real)(0.0f), most),
                      clamp_r(rgb.z, (real)(0.0f), most)};
}
inline Wavelengths wavelengths_sample(Scene scene, real u) { return spectrum_of(0.0f); }
/* What a sample adds to a pixel: rgb. */
inline vec3 film_value(Scene scene, Spectrum radiance, Wavelengths lambdas)
{
    return v3(radiance.x, radiance.y, radiance.z);
}
