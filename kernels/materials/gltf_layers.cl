/* What the layers of glTF's materials are made of: directional albedos of microfacets and of sheen, by
 * which a layer dims what lies under it, the sheen itself, and iridescence. Cosines are positive;
 * roughness is what files give, its square alpha. The albedos are fitted to quadrature. */
#include "materials/fresnel.cl"
#include "materials/microfacet.cl"
#include "materials/microfacet.cl#refracting"

/* Directional albedo of GGX facets with separable Smith masking, in parts: what a facet's reflectance
 * f0 + (f90 - f0) (1 - cos)^5 adds up to is f0 a + f90 b. */
typedef struct { real a, b; } FacetAlbedo;

/* The whole off by up to 0.019, 0.005 in the mean; b by up to 0.023, 0.003 in the mean. */
inline FacetAlbedo facet_albedo(real c, real r)
{
    real a = r * r, s = sqrt(c * c + a * a * (1.0f - c * c)), g = c / max_r(s, (real)(1e-6f)), q = sqrt(s);
    real lost = 0.0558425f + g * (0.0832611f + g * (-0.143321f + g * (0.851837f - g * 0.845735f)))
        + a * (0.129016f + g * (-0.256384f + g * (-1.03735f + g * 1.16517f))
        + a * (0.416246f + g * (1.90492f - g * 0.539495f) + a * (-0.364104f - g * 0.864949f + a * 0.142029f)));
    real grazing = -0.09626f + q * (2.94712f + q * (-23.97655f + q * (41.86795f - q * 31.96983f)))
        + r * (-3.90619f + q * (33.38652f + q * (-62.27225f + q * 6.4272f))
        + r * (-19.45474f + q * (6.35487f + q * 155.23344f) + r * (26.80108f - q * 244.35661f + r * 108.35697f)));
    real whole = clamp_r(1.0f - lost, (real)(0.0f), (real)(1.0f));
    FacetAlbedo e;
    e.b = min_r(exp_r(grazing), whole);
    e.a = whole - e.b;
    return e;
}
/* Their means over a cosine-weighted hemisphere, off by up to 0.002. */
inline FacetAlbedo facet_albedo_mean(real r)
{
    FacetAlbedo e;
    e.b = 0.046f + r * (0.05371f + r * (-0.46251f + r * (0.61211f - r * 0.24771f)));
    e.a = 1.00035f + r * (-0.02889f + r * (0.41878f + r * (-2.3757f + r * 1.36386f))) - e.b;
    return e;
}

/* The least roughness of sheen: below, what Charlie reflects at grazing angles exceeds what comes. */
#define SHEEN_ROUGHEST 0.25f
/* l of Estevez and Kulla 2017, their logarithm of Smith's Lambda. */
inline real charlie_l(real x, real t)
{
    real a = 21.5473f + t * 3.7772f, b = 3.82987f - t * 0.50552f, c = 0.19823f - t * 0.03022f;
    real d = -1.9776f + t * 0.70367f, e = -4.32054f - t * 0.53913f;
    return a / (1.0f + b * pow_r(x, c)) + d * x + e;
}
inline real charlie_lambda(real c, real t)
{
    mask steep = c < 0.5f;
    real l = charlie_l(sel(steep, c, 1.0f - c), t);
    return exp_r(sel(steep, l, 2.0f * charlie_l((real)(0.5f), t) - l));
}
/* D G / (4 |cos_o|) of upright fibres (Estevez and Kulla 2017): f |cos_i| for white fibres. */
inline real charlie(real cos_o, real cos_i, vec3 h, real roughness)
{
    real r = max_r(roughness, (real)(SHEEN_ROUGHEST)), inv = 1.0f / (r * r), t = sqr(1.0f - r * r);
    real d = (2.0f + inv) * pow_r(max_r(1.0f - h.z * h.z, (real)(0.0f)), 0.5f * inv) * INV_2PI;
    real g = 1.0f / (1.0f + charlie_lambda(cos_o, t) + charlie_lambda(cos_i, t));
    return d * g / max_r(4.0f * cos_o, (real)(1e-6f));
}
/* Its directional albedo, off by up to 0.025, 0.01 in the mean. */
inline real charlie_albedo(real c, real roughness)
{
    real r = max_r(roughness, (real)(SHEEN_ROUGHEST)), q = pow_r(c, (real)(1.0f / 3.0f));
    real e = 2.02232f + q * (0.710323f + q * (-12.5692f + q * (14.2241f - q * 4.51913f)))
        + r * (-7.04703f + q * (12.3489f + q * (-1.97103f - q * 2.66651f))
        + r * (9.93445f + q * (-15.0909f + q * 4.17055f) + r * (-4.07011f + q * 4.82395f - r * 0.143575f)));
    return clamp_r(e, (real)(0.0f), (real)(1.0f));
}

/* How much a coloured layer hides: in RGB mode as much as its strongest channel, lest what lies under it
 * take the opposite colour (KHR_materials_specular); in spectral mode each wavelength has its own. */
inline Spectrum layer_cover(Spectrum s)
{
#if SPECTRUM_SIZE == 3
    s = spectrum_of(spectrum_max(s));
#endif
    return s;
}

/* A film between vacuum and a base that reflects f0 at normal incidence, of index `film` and a thickness
 * [nm]: its reflectance at cosine c (Belcour and Barla 2017, with the approximations of
 * KHR_materials_iridescence: Schlick's reflectances and no polarisation). `turns` are 2 n d cos / 1 nm and
 * shifts of half a wave; the endless reflections are summed at each wavelength [nm], in RGB mode those
 * of the first two orders as the observer's Gaussians see them. */
typedef struct { Spectrum dc, cm, r, shift; } FilmSeries; /* of their eq. 10: constant, first factor, ratio */

inline Spectrum film_colours(FilmSeries f, real path, Spectrum lambdas)
{
    Spectrum v;
#if SPECTRUM_SIZE == 3
    Spectrum one = spectrum_of(0.0f), two = one; /* xyz of the first two orders, by the cosine's double angle */
    real d2 = path * path;
#define WAVE(at, centre, fall, height)                                     \
    {                                                                      \
        real turns = path * centre + f.shift.at;                           \
        real wave = cos_2pi(turns - floor(turns)), g = exp_r(-fall * d2);  \
        one.at += height * wave * g;                                       \
        two.at += height * (2.0f * wave * wave - 1.0f) * sqr(sqr(g));      \
    }
    WAVE(x, 1.6810e-3f, 1.708547e-7f, 0.8465900f)
    WAVE(x, 2.2399e-3f, 1.787662e-7f, 0.1538683f)
    WAVE(y, 1.7953e-3f, 3.673309e-7f, 1.0002219f)
    WAVE(z, 2.2084e-3f, 2.610352e-7f, 1.0011225f)
#undef WAVE
#define ROW(at, x_, y_, z_)                                                                     \
    {                                                                                           \
        real first = x_ * one.x + y_ * one.y + z_ * one.z;                                      \
        real second = x_ * two.x + y_ * two.y + z_ * two.z;                                     \
        v.at = f.dc.at + 2.0f * f.cm.at * f.r.at * (first + f.r.at * second);                   \
    }
    ROW(x, 3.2404542f, -1.5371385f, -0.4985314f)
    ROW(y, -0.9692660f, 1.8760108f, 0.0415560f)
    ROW(z, 0.0556434f, -0.2040259f, 1.0572252f)
#undef ROW
#else
#define C(c)                                                                                       \
    {                                                                                              \
        real turns = path / lambdas.c + f.shift.c, wave = cos_2pi(turns - floor(turns));           \
        real low = 1.0f - 2.0f * f.r.c * wave + f.r.c * f.r.c;                                     \
        v.c = f.dc.c + 2.0f * f.cm.c * (f.r.c * wave - f.r.c * f.r.c) / max_r(low, (real)(1e-4f)); \
    }
    SPECTRUM_EACH(C)
#undef C
#endif
    return v;
}
/* A base of reflectance f0 at normal incidence, under the film: what their boundary reflects, and the shift. */
typedef struct { Spectrum reflectance, shift; } FilmBase;

inline FilmBase film_base(Spectrum f0, real film)
{
    FilmBase b;
#define C(c)                                                                                            \
    {                                                                                                   \
        real root = sqrt_r(min_r(f0.c + 1e-4f, (real)(0.9998f))), base = (1.0f + root) / (1.0f - root); \
        b.reflectance.c = sqr((base - film) / (base + film));                                           \
        b.shift.c = 0.5f + sel(base < film, (real)(0.5f), (real)(0.0f));                                \
    }
    SPECTRUM_EACH(C)
#undef C
    return b;
}
inline Spectrum iridescence(real c, FilmBase base, real film, real thickness, Spectrum lambdas)
{
    real cos2 = 1.0f - (1.0f - c * c) / (film * film), c2 = sqrt_r(cos2), w = 1.0f - c, w2 = 1.0f - c2;
    real r0 = sqr((film - 1.0f) / (film + 1.0f)), r12 = r0 + (1.0f - r0) * w * w * w * w * w, t = 1.0f - r12;
    real grazing = w2 * w2 * w2 * w2 * w2;
    FilmSeries f;
    Spectrum v;
#define C(c)                                                               \
    {                                                                      \
        real r1 = base.reflectance.c, r23 = r1 + (1.0f - r1) * grazing;    \
        real both = clamp_r(r12 * r23, (real)(1e-5f), (real)(0.9999f));    \
        real rs = t * t * r23 / (1.0f - both);                             \
        f.dc.c = r12 + rs;                                                 \
        f.cm.c = rs - t;                                                   \
        f.r.c = sqrt(both);                                                \
        f.shift.c = base.shift.c;                                          \
    }
    SPECTRUM_EACH(C)
#undef C
    Spectrum made = film_colours(f, 2.0f * film * thickness * c2, lambdas);
#define C(c) v.c = sel(cos2 <= 0.0f, (real)(1.0f), clamp_r(made.c, (real)(0.0f), (real)(1.0f)));
    SPECTRUM_EACH(C)
#undef C
    return v;
}
