/* Rough metal of mirror-like microfacets, front side (Cook and Torrance 1982; Walter et al. 2007
 * eq. 20): f = F D G / (4 |cos| |cos|) [1/sr], G the product of Smith's two; normals are sampled as
 * wo sees them. F is the reflectance of the thin films, if facets have films. Single bounce between facets: the energy
 * of further bounces is lost. */
#include "materials/fresnel.cl"
#include "materials/microfacet.cl"

BsdfSample rough_conductor_sample(RoughConductor m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    Microfacets d = microfacets_of(m.distribution, m.alpha_u, m.alpha_v);
    vec2 uv = {u.x, u.y};
    vec3 h = microfacet_visible(d, wo, uv);
    s.wi = reflect_at(wo, h);
    real cos_h = dot3(wo, h);
    mask seen = (wo.z > 0.0f) & (s.wi.z > 0.0f) & (cos_h > 0.0f);
    real g = microfacet_g1(d, s.wi, h);
    Spectrum f = conductor_boundary(m.layers, clamp_r(cos_h, (real)(0.0f), (real)(1.0f)), m.eta, m.k);
    s.weight = spectrum_scale(spectrum_mul(m.specular_reflectance, f), g);
    real pdf = microfacet_visible_pdf(d, wo, h) / max_r(4.0f * cos_h, (real)(1e-20f));
    s.pdf = sel(seen, pdf, (real)(0.0f));
    return s;
}

Spectrum rough_conductor_eval(RoughConductor m, vec3 wo, vec3 wi)
{
    Microfacets d = microfacets_of(m.distribution, m.alpha_u, m.alpha_v);
    vec3 h = normalize3(add3(wo, wi));
    mask front = (wo.z > 0.0f) & (wi.z > 0.0f);
    real g = microfacet_g1(d, wo, h) * microfacet_g1(d, wi, h);
    real v = microfacet_d(d, h) * g / max_r(4.0f * wo.z, (real)(1e-20f));
    Spectrum f = conductor_boundary(m.layers, clamp_r(dot3(wo, h), (real)(0.0f), (real)(1.0f)), m.eta, m.k);
    return spectrum_scale(spectrum_mul(m.specular_reflectance, f), sel(front, v, (real)(0.0f)));
}

real rough_conductor_pdf(RoughConductor m, vec3 wo, vec3 wi)
{
    Microfacets d = microfacets_of(m.distribution, m.alpha_u, m.alpha_v);
    vec3 h = normalize3(add3(wo, wi));
    real pdf = microfacet_visible_pdf(d, wo, h) / max_r(4.0f * dot3(wo, h), (real)(1e-20f));
    return sel((wo.z > 0.0f) & (wi.z > 0.0f), pdf, (real)(0.0f));
}

Spectrum rough_conductor_albedo(RoughConductor m)
{
    return spectrum_mul(m.specular_reflectance, conductor_boundary(m.layers, (real)(1.0f), m.eta, m.k));
}
