/* What OpenPBR's layers are made of beside those of glTF's: rough diffuse light, fuzz, and metal with a tinted edge. */
#include "materials/gltf_layers.cl"
#include "materials/facet_reflectance.cl"

/* Diffuse reflection that keeps energy (Portsmouth, Kutz and Hill 2024, "EON"): facets like grooves, as Fujii has them,
 * and light that meets several. r: roughness in [0, 1]. */
#define EON_SINGLE 0.287793409f /* 1/2 - 2 / (3 pi) */
#define EON_MEAN 0.072488212f   /* 2/3 - 28 / (15 pi) */
/* Directional albedo of white single grooves, by their polynomial. */
inline real eon_albedo(real c, real r)
{
    real x = 1.0f - c, g = x * (0.0571085289f + x * (0.491881867f + x * (-0.332181442f + x * 0.0714429953f)));
    return (1.0f + r * g) / (1.0f + EON_SINGLE * r);
}
/* pi f over the colour. */
inline Spectrum eon(Spectrum colour, real r, vec3 wo, vec3 wi)
{
    real s = dot3(wo, wi) - wo.z * wi.z, t = max_r(max_r(wo.z, wi.z), (real)(1e-6f));
    real single = (1.0f + r * sel(s > 0.0f, s / t, s)) / (1.0f + EON_SINGLE * r);
    real mean = (1.0f + EON_MEAN * r) / (1.0f + EON_SINGLE * r), lost = 1.0f - mean;
    real several = max_r(1.0f - eon_albedo(wo.z, r), (real)(0.0f)) * max_r(1.0f - eon_albedo(wi.z, r), (real)(0.0f));
    several /= max_r(lost, (real)(1e-6f));
    Spectrum v;
#define C(c) v.c = single + colour.c * mean * several / (1.0f - colour.c * lost);
    SPECTRUM_EACH(C)
#undef C
    return v;
}

/* Fuzz: a layer of fibres by simulation, a linearly transformed cosine (Zeltner, Burley and Chiang 2022). The fits by
 * cosine c and roughness r are those of MaterialX 1.39 (mx_microfacet_sheen.glsl, Apache 2.0). */
typedef struct { real c, r, a, b; } FuzzLobe; /* a, b: of the inverse transform (a, 0, b; 0, a, 0; 0, 0, 1) */
inline FuzzLobe fuzz_lobe(real cosine, real roughness)
{
    real c = clamp_r(cosine, (real)(1e-3f), (real)(1.0f)), r = clamp_r(roughness, (real)(0.1f), (real)(1.0f));
    FuzzLobe l = {c, r, (real)(0.0f), (real)(0.0f)};
    l.a = (2.58126f * c + 0.813703f * r) * r / (1.0f + 0.310327f * c * c + 2.60994f * c * r);
    real low = 0.0000254053f + 1.71228f * c - 1.71506f * c * r + 1.34174f * r * r;
    l.b = sqrt_r(1.0f - c) * (r - 1.0f) * r * r * r / low;
    return l;
}
inline real fuzz_albedo(FuzzLobe l)
{
    real r = l.r, s = r * (0.0206607f + 1.58491f * r) / (0.0379424f + r * (1.32227f + r));
    real m = r * (-0.193854f + r * (-1.14885f + r * (1.7932f - 0.95943f * r * r))) / (0.046391f + r);
    real o = r * (0.000654023f + (-0.0207818f + 0.119681f * r) * r) / (1.26264f + r * (-1.92021f + r));
    real e = exp_r(-0.5f * sqr((l.c - m) / s)) * 0.398942280f / s + o;
    return clamp_r(e, (real)(0.0f), (real)(1.0f));
}
/* Its mean over a cosine-weighted hemisphere, off by up to 0.0005. */
inline real fuzz_albedo_mean(FuzzLobe l)
{
    real r = l.r;
    return -0.00283371f + r * (0.01965001f + r * (0.14794671f + r * (0.89122589f - r * 0.61108253f)));
}
/* The unit vector along the projection of w. */
inline vec2 fuzz_azimuth(vec3 w)
{
    real r2 = w.x * w.x + w.y * w.y, inv = 1.0f / sqrt(max_r(r2, (real)(1e-20f)));
    return (vec2){sel(r2 > 1e-14f, w.x * inv, (real)(1.0f)), sel(r2 > 1e-14f, w.y * inv, (real)(0.0f))};
}
/* The density of wi in the lobe of wo [1/sr]. */
inline real fuzz_pdf(FuzzLobe l, vec3 wo, vec3 wi)
{
    vec2 p = fuzz_azimuth(wo);
    real x = p.x * wi.x + p.y * wi.y, y = p.x * wi.y - p.y * wi.x;
    real d = sqr(l.a * x + l.b * wi.z) + sqr(l.a * y) + sqr(wi.z);
    return sel(wi.z > 0.0f, wi.z * INV_PI * sqr(l.a / max_r(d, (real)(1e-12f))), (real)(0.0f));
}
inline vec3 fuzz_sample(FuzzLobe l, vec3 wo, vec2 u)
{
    vec3 w = cosine_hemisphere(u);
    vec2 p = fuzz_azimuth(wo);
    real x = (w.x - l.b * w.z) / l.a, y = w.y / l.a;
    return normalize3(v3(p.x * x - p.y * y, p.y * x + p.x * y, w.z));
}
/* f |cos| of white fuzz. The fits of the two directions differ, and light is reversible: the lesser of both. */
inline real fuzz(FuzzLobe o, FuzzLobe i, vec3 wo, vec3 wi)
{
    real there = fuzz_albedo(o) * fuzz_pdf(o, wo, wi), back = fuzz_albedo(i) * fuzz_pdf(i, wi, wo);
    return min_r(there, back * wi.z / max_r(wo.z, (real)(1e-6f)));
}

/* Schlick's reflectance of a metal with a factor on it at 82 degrees (Kutz, Hasan and Edmondson 2021); c: cosine. */
inline real metal_edge(real f0, real edge, real c)
{
    real x = 1.0f - c, x2 = x * x, x5 = x2 * x2 * x, at82 = f0 + (1.0f - f0) * 0.462664366f;
    return f0 + (1.0f - f0) * x5 - 17.6513846f * at82 * (1.0f - edge) * c * x5 * x;
}
/* Its mean over a cosine-weighted hemisphere. */
inline real metal_edge_mean(real f0, real edge)
{
    real at82 = f0 + (1.0f - f0) * 0.462664366f;
    return f0 + (1.0f - f0) * (1.0f / 21.0f) - 17.6513846f * at82 * (1.0f - edge) * (1.0f / 126.0f);
}
