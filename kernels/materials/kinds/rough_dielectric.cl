/* Rough boundary of two dielectrics, both sides (Walter et al. 2007 eq. 20 and 21): microfacets
 * reflect or refract by Fresnel's share; normals are sampled as wo sees them. Radiance that is
 * refracted is scaled by 1 / eta^2. Single event at a facet: the energy of further events is lost.
 * With a dispersive index each wavelength has its own half vector, so eval is exact at all of them;
 * directions are sampled for the hero. Thin films on the facets change the shares, not the directions. */
#include "materials/fresnel.cl"
#include "materials/microfacet.cl"

/* The index, kept away from 1: there a facet would not bend light, and h would be undefined. */
inline Spectrum rough_dielectric_index(RoughDielectric m)
{
    Spectrum eta = relative_index(m.int_ior, m.ext_ior);
#define C(c) eta.c = sel(fabs(eta.c - 1.0f) < 1e-3f, (real)(1.001f), eta.c);
    SPECTRUM_EACH(C)
#undef C
    return eta;
}

/* The facet of a pair of directions at an index. */
typedef struct {
    vec3 h;        /* half vector, on the front */
    Boundary b;    /* what the facet reflects and lets through */
    real jacobian; /* solid angle of normals per solid angle of wi, times |cos| between h and wi */
    real scale;    /* of radiance: 1, or 1 / eta^2 */
    mask shading;   /* both directions see the facet from their own sides */
} RoughDielectricPair;

inline RoughDielectricPair rough_dielectric_pair(RoughDielectric m, vec3 wo, vec3 wi, real index)
{
    RoughDielectricPair p;
    mask reflected = wo.z * wi.z > 0.0f;
    real eta = sel(reflected, (real)(1.0f), sel(wo.z > 0.0f, index, 1.0f / index));
    vec3 h = normalize3(madd3(wi, eta, wo));
    p.h = scale3(h, sel(h.z < 0.0f, (real)(-1.0f), (real)(1.0f)));
    real o = dot3(wo, p.h), i = dot3(wi, p.h);
    p.b = facet_boundary(m.layers, clamp_r(o, (real)(-1.0f), (real)(1.0f)), index, m.ext_ior);
    real refracted = sqr(eta) * fabs(i) / max_r(sqr(o + eta * i), (real)(1e-20f));
    p.jacobian = sel(reflected, 0.25f / max_r(fabs(o), (real)(1e-20f)), refracted);
    p.scale = 1.0f / sqr(eta);
    p.shading = (o * wo.z > 0.0f) & (i * wi.z > 0.0f);
    return p;
}

/* f |cos| at an index, without the colours. */
inline Spectrum rough_dielectric_value(RoughDielectric m, Microfacets d, vec3 wo, vec3 wi, real index)
{
    RoughDielectricPair p = rough_dielectric_pair(m, wo, wi, index);
    Spectrum share = spectrum_sel(wo.z * wi.z > 0.0f, p.b.r, spectrum_scale(p.b.t, p.scale));
    real pdf = microfacet_visible_pdf(d, wo, p.h) * p.jacobian;
    return spectrum_scale(share, sel(p.shading, pdf * microfacet_g1(d, wi, p.h), (real)(0.0f)));
}

Spectrum rough_dielectric_eval(RoughDielectric m, vec3 wo, vec3 wi)
{
    Microfacets d = microfacets_of(m.distribution, m.alpha_u, m.alpha_v);
    Spectrum eta = rough_dielectric_index(m);
    Spectrum v = rough_dielectric_value(m, d, wo, wi, eta.x);
    if (any(spectrum_varies(eta))) {
#define C(c) SPECTRUM_PUT(v, c, SPECTRUM_AT(rough_dielectric_value(m, d, wo, wi, SPECTRUM_AT(eta, c)), c));
        SPECTRUM_IN_TURN(C)
#undef C
    }
    mask reflected = wo.z * wi.z > 0.0f;
    return spectrum_mul(v, spectrum_sel(reflected, m.specular_reflectance, m.specular_transmittance));
}

/* pdf for a hero with this index. */
inline real rough_dielectric_density(RoughDielectric m, Microfacets d, vec3 wo, vec3 wi, real index)
{
    RoughDielectricPair p = rough_dielectric_pair(m, wo, wi, index);
    real share = sel(wo.z * wi.z > 0.0f, p.b.p, 1.0f - p.b.p);
    return sel(p.shading, share * microfacet_visible_pdf(d, wo, p.h) * p.jacobian, (real)(0.0f));
}

Spectrum rough_dielectric_pdfs(RoughDielectric m, vec3 wo, vec3 wi)
{
    Microfacets d = microfacets_of(m.distribution, m.alpha_u, m.alpha_v);
    Spectrum eta = rough_dielectric_index(m);
    Spectrum v = spectrum_of(rough_dielectric_density(m, d, wo, wi, eta.x));
    if (any(spectrum_varies(eta))) {
#define C(c) SPECTRUM_PUT(v, c, rough_dielectric_density(m, d, wo, wi, SPECTRUM_AT(eta, c)));
        SPECTRUM_IN_TURN(C)
#undef C
    }
    return v;
}

real rough_dielectric_pdf(RoughDielectric m, vec3 wo, vec3 wi)
{
    Microfacets d = microfacets_of(m.distribution, m.alpha_u, m.alpha_v);
    return rough_dielectric_density(m, d, wo, wi, rough_dielectric_index(m).x);
}

BsdfSample rough_dielectric_sample(RoughDielectric m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    Microfacets d = microfacets_of(m.distribution, m.alpha_u, m.alpha_v);
    Spectrum eta = rough_dielectric_index(m);
    vec2 uv = {u.x, u.y};
    vec3 h = microfacet_visible(d, scale3(wo, sel(wo.z < 0.0f, (real)(-1.0f), (real)(1.0f))), uv);
    real o = dot3(wo, h);
    Fresnel f = fresnel_dielectric(o, eta.x);
    mask reflected = u.z < facet_boundary(m.layers, o, eta.x, m.ext_ior).p;
    vec3 refracted = normalize3(sub3(scale3(h, o / f.eta + f.cos_t), scale3(wo, 1.0f / f.eta)));
    s.wi = sel3(reflected, reflect_at(wo, h), refracted);
    mask kept = reflected == (wo.z * s.wi.z > 0.0f);
    s.pdf = sel(kept, rough_dielectric_pdf(m, wo, s.wi), (real)(0.0f));
    s.weight = spectrum_scale(rough_dielectric_eval(m, wo, s.wi), sel(s.pdf > 0.0f, 1.0f / s.pdf, (real)(0.0f)));
    s.eta = sel(reflected, (real)(1.0f), f.eta);
    s.lobe = sel_i(reflected, (integer)(LOBE_REFLECT), (integer)(LOBE_TRANSMIT));
    return s;
}

Spectrum rough_dielectric_albedo(RoughDielectric m) { return m.specular_transmittance; }

real rough_dielectric_across(RoughDielectric m) { return rough_dielectric_index(m).x; }
