/* Microfacet normals: density D [1/sr], Smith's masking G1, and sampling of the normals that wo sees.
 * Directions in the local frame; the normal m is on the front (m.z >= 0). Anisotropic along x and y.
 * GGX and Beckmann as in Walter et al. 2007; Beckmann's G1 is their rational fit (eq. 27). */
typedef struct {
    mask beckmann; /* else GGX: the positions in materials.DISTRIBUTIONS */
    real alpha_u, alpha_v;
} Microfacets;

inline Microfacets microfacets_of(integer distribution, real alpha_u, real alpha_v)
{
    return (Microfacets){distribution == 1, max_r(alpha_u, (real)(1e-4f)), max_r(alpha_v, (real)(1e-4f))};
}

/* D(m), normalised so that the integral of D(m) m.z over the hemisphere is 1. */
inline real microfacet_d(Microfacets d, vec3 m)
{
    real c2 = m.z * m.z, s = sqr(m.x / d.alpha_u) + sqr(m.y / d.alpha_v), area = PI * d.alpha_u * d.alpha_v;
    real r = 1.0f / (area * sqr(s + c2));
    if (any(d.beckmann)) {
        real safe = max_r(c2, (real)(1e-12f));
        r = sel(d.beckmann, exp_r(-s / safe) / (area * safe * safe), r);
    }
    return sel((m.z > 0.0f) & (r * m.z > 1e-20f), r, (real)(0.0f));
}

/* Smith's G1(v, m): the share of the facets of normal m that v sees; 0 for their backs. */
inline real microfacet_g1(Microfacets d, vec3 v, vec3 m)
{
    real z = fabs(v.z), s2 = sqr(d.alpha_u * v.x) + sqr(d.alpha_v * v.y);
    real r = 2.0f * z / max_r(z + sqrt(z * z + s2), (real)(1e-20f));
    if (any(d.beckmann)) {
        real a = z / max_r(sqrt(s2), (real)(1e-20f)); /* 1 / (alpha tan theta) */
        real fit = a * (3.535f + 2.181f * a) / (1.0f + a * (2.276f + 2.577f * a));
        r = sel(d.beckmann, sel(a < 1.6f, fit, (real)(1.0f)), r);
    }
    return sel(dot3(v, m) * v.z > 0.0f, r, (real)(0.0f));
}

/* Density of the normals that w sees, w.z > 0 [1/sr] (Heitz 2018 eq. 3). */
inline real microfacet_visible_pdf(Microfacets d, vec3 w, vec3 m)
{
    return microfacet_d(d, m) * microfacet_g1(d, w, m) * fabs(dot3(w, m)) / max_r(fabs(w.z), (real)(1e-20f));
}

/* GGX normals seen by w after stretching: a spherical cap about w (Dupuy and Benyoub 2023). */
inline vec3 ggx_visible_slopes(vec3 w, vec2 u)
{
    real s, c, up = (1.0f - u.x) * (1.0f + w.z), z = up - w.z, r = sqrt_r(1.0f - z * z);
    sincos_2pi(u.y, &s, &c);
    return v3(r * c + w.x, r * s + w.y, up);
}

/* Beckmann normals seen by w after stretching. Along w, the slope x of a visible facet has a
 * distribution function proportional to 1 + erf x + tan(theta) exp(-x^2) / sqrt(pi) up to the slope
 * that faces away; it is inverted by Newton's method in erf x, where its derivative is plain
 * (Heitz and d'Eon 2014; Jakob 2014). Across w, the slope is normal. */
inline vec3 beckmann_visible_slopes(vec3 w, vec2 u)
{
    real sin_t = sqrt_r(w.x * w.x + w.y * w.y), tan_t = sin_t / max_r(w.z, (real)(1e-6f));
    real cot = w.z / max_r(sin_t, (real)(1e-6f));
    real high = erf_r(cot), k = tan_t * 0.564189584f; /* 1 / sqrt(pi) */
    real target = clamp_r(u.x, (real)(1e-6f), (real)(0.999999f));
    real b = high - (high + 1.0f) * erf_r(sqrt_r(-log_r(target)));
    target *= 1.0f + high + k * exp_r(-cot * cot);
    for (int i = 0; i < 3; ++i) {
        real x = erfinv_r(b);
        real slope = 1.0f - x * tan_t;
        b -= (1.0f + b + k * exp_r(-x * x) - target) / max_r(slope, (real)(1e-6f));
        b = clamp_r(b, (real)(-0.999999f), min_r(high, (real)(0.999999f)));
    }
    real x = erfinv_r(b), y = erfinv_r(clamp_r(2.0f * u.y - 1.0f, (real)(-0.999999f), (real)(0.999999f)));
    mask tilted = sin_t > 0.0f;
    real inv = 1.0f / max_r(sin_t, (real)(1e-20f));
    real cos_p = sel(tilted, w.x * inv, (real)(1.0f)), sin_p = sel(tilted, w.y * inv, (real)(0.0f));
    return v3(-(cos_p * x - sin_p * y), -(sin_p * x + cos_p * y), (real)(1.0f));
}

/* A normal that w sees, w.z >= 0. */
inline vec3 microfacet_visible(Microfacets d, vec3 w, vec2 u)
{
    vec3 stretched = normalize3(v3(w.x * d.alpha_u, w.y * d.alpha_v, w.z));
    vec3 h = ggx_visible_slopes(stretched, u);
    if (any(d.beckmann))
        h = sel3(d.beckmann, beckmann_visible_slopes(stretched, u), h);
    return normalize3(v3(h.x * d.alpha_u, h.y * d.alpha_v, max_r(h.z, (real)(1e-12f))));
}

/* Step refracting: the facet that sends light from wi to wo, by reflection or by refraction (Walter et al. 2007, 4.2).
  */
typedef struct {
    vec3 h;        /* its normal, on the front */
    real o, i;     /* signed cosines of wo and wi to it */
    real jacobian; /* solid angle of normals per solid angle of wi, times |o| over that of wo */
    mask shading;   /* both directions see the facet from their own sides */
} RefractingFacet;

/* eta: index of the side of wi over that of wo; 1 for reflection. */
inline RefractingFacet refracting_facet(vec3 wo, vec3 wi, real eta)
{
    RefractingFacet p;
    mask reflected = wo.z * wi.z > 0.0f;
    vec3 h = normalize3(madd3(wi, eta, wo));
    p.h = scale3(h, sel(h.z < 0.0f, (real)(-1.0f), (real)(1.0f)));
    p.o = clamp_r(dot3(wo, p.h), (real)(-1.0f), (real)(1.0f));
    p.i = clamp_r(dot3(wi, p.h), (real)(-1.0f), (real)(1.0f));
    real refracted = sqr(eta) * fabs(p.i) / max_r(sqr(p.o + eta * p.i), (real)(1e-20f));
    p.jacobian = sel(reflected, 0.25f / max_r(fabs(p.o), (real)(1e-20f)), refracted);
    p.shading = (p.o * wo.z > 0.0f) & (p.i * wi.z > 0.0f);
    return p;
}

/* wi as facets see it: what goes straight through a thin sheet is mirrored in it. */
inline vec3 sheet_seen(mask thin, vec3 wo, vec3 wi)
{
    return v3(wi.x, wi.y, sel(thin & (wo.z * wi.z < 0.0f), -wi.z, wi.z));
}
/* The facet that sends light from wi to wo, by reflection, or by transmission at an index; thin: of a sheet. */
inline RefractingFacet sheet_facet(mask thin, int transmits, vec3 wo, vec3 wi, real index)
{
    real eta = 1.0f;
    if (transmits) eta = sel(!thin & (wo.z * wi.z < 0.0f), sel(wo.z > 0.0f, index, 1.0f / index), eta);
    return refracting_facet(wo, sheet_seen(thin, wo, wi), eta);
}

/* f |cos| of radiance that crosses a boundary with nothing lost but by Fresnel's reflection; index: of
 * the inside over the outside. */
inline real refracting_facet_transmitted(Microfacets d, vec3 wo, vec3 wi, real index)
{
    real eta = sel(wo.z > 0.0f, index, 1.0f / index);
    RefractingFacet p = refracting_facet(wo, wi, eta);
    real passed = (1.0f - fresnel_dielectric(p.o, index).f) / sqr(eta);
    real v = microfacet_visible_pdf(d, wo, p.h) * p.jacobian * microfacet_g1(d, wi, p.h) * passed;
    return sel(p.shading & (wo.z * wi.z < 0.0f), v, (real)(0.0f));
}
