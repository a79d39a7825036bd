/* Rough diffuse reflection of the front (Oren and Nayar 1994): facets like grooves, whose slopes have
 * the deviation sigma [degrees]. Without interreflection their qualitative model, f = r / pi (A + B max(0,
 * cos p) sin a tan b) [1/sr], p the angle between the azimuths, a the larger polar angle and b the
 * smaller; with it the full model, with light that meets two facets. The fits exceed 1 by up to
 * 0.046 at grazing angles: reflectances above 1 - min(0.046, 0.16 sigma) count as that. */

typedef struct {
    real single, twice; /* f cos / r of a single facet, and f cos / r^2 of two */
} OrenNayarTerms;

/* Both terms times the cosine of wi, 0 behind. */
inline OrenNayarTerms oren_nayar_terms(OrenNayar m, vec3 wo, vec3 wi)
{
    mask front = (wo.z > 0.0f) & (wi.z > 0.0f), full = m.interreflection != 0;
    real sigma = m.sigma * (real)(0.0174532925f), s2 = sigma * sigma;
    real sin_o = sqrt_r(max_r(1.0f - wo.z * wo.z, (real)(0.0f)));
    real sin_i = sqrt_r(max_r(1.0f - wi.z * wi.z, (real)(0.0f)));
    real both = sin_o * sin_i, cos_p = (wo.x * wi.x + wo.y * wi.y) / max_r(both, (real)(1e-6f));
    cos_p = sel(both > 1e-6f, min_r(max_r(cos_p, (real)(-1.0f)), (real)(1.0f)), (real)(0.0f));
    real cos_a = min_r(wo.z, wi.z), cos_b = max_r(max_r(wo.z, wi.z), (real)(1e-6f));
    real sin_a = max_r(sin_o, sin_i), sin_b = min_r(sin_o, sin_i), tan_b = sin_b / cos_b;
    real c1 = 1.0f - 0.5f * s2 / (s2 + 0.33f), slope = s2 / (s2 + 0.09f), c2 = 0.45f * slope;
    real b = acos_r(cos_b) * (2.0f * INV_PI), a = acos_r(cos_a) * (2.0f * INV_PI), ab = a * b;
    real behind = sel(cos_p > 0.0f, (real)(0.0f), b * b * b);
    real half_tan = (sin_a + sin_b) / max_r(cos_a + cos_b, (real)(1e-6f));
    real single = c1 + cos_p * c2 * (sin_a - behind) * tan_b
                  + (1.0f - fabs(cos_p)) * 0.125f * slope * ab * ab * half_tan;
    real plain = c1 + max_r(cos_p, (real)(0.0f)) * c2 * sin_a * tan_b;
    real twice = 0.17f * s2 / (s2 + 0.13f) * (1.0f - cos_p * b * b);
    OrenNayarTerms t;
    t.single = sel(front, max_r(sel(full, single, plain), (real)(0.0f)) * wi.z * INV_PI, (real)(0.0f));
    t.twice = sel(front & full, twice * wi.z * INV_PI, (real)(0.0f));
    return t;
}

/* The reflectance that counts. */
inline Spectrum oren_nayar_reflectance(OrenNayar m)
{
    real most = 1.0f - min_r(m.sigma * (real)(0.0027925f), (real)(0.046f));
    Spectrum r;
#define C(c) r.c = min_r(m.reflectance.c, most);
    SPECTRUM_EACH(C)
#undef C
    return r;
}

Spectrum oren_nayar_eval(OrenNayar m, vec3 wo, vec3 wi)
{
    OrenNayarTerms t = oren_nayar_terms(m, wo, wi);
    Spectrum r = oren_nayar_reflectance(m);
    return spectrum_mul(r, spectrum_madd(r, t.twice, spectrum_of(t.single)));
}

real oren_nayar_pdf(OrenNayar m, vec3 wo, vec3 wi)
{
    return sel(wo.z > 0.0f, cosine_hemisphere_pdf(wi.z), (real)(0.0f));
}

BsdfSample oren_nayar_sample(OrenNayar m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    vec2 uv = {u.x, u.y};
    s.wi = cosine_hemisphere(uv);
    s.pdf = oren_nayar_pdf(m, wo, s.wi);
    s.weight = spectrum_scale(oren_nayar_eval(m, wo, s.wi), sel(s.pdf > 0.0f, 1.0f / s.pdf, (real)(0.0f)));
    return s;
}

Spectrum oren_nayar_albedo(OrenNayar m) { return m.reflectance; }
