/* A diffuse base under a rough dielectric coat, front side: microfacets on top (Walter et al. 2007
 * eq. 20), and below, as in materials/kinds/plastic.cl, f = T(wo) T(wi) d / (pi eta^2 (1 - d' R)) [1/sr], with the
 * rough coat's transmittance T and inner reflectance R, d' being d or, if the colour is kept linear, 1. */
#include "materials/fresnel.cl"
#include "materials/microfacet.cl"
#include "materials/rough_coat.cl"

inline Microfacets rough_plastic_facets(RoughPlastic m) { return microfacets_of(m.distribution, m.alpha, m.alpha); }

/* The probability of the coat's reflection, from the two parts' strengths; t: the mean of T(wo). */
inline real rough_plastic_coat_probability(RoughPlastic m, real t)
{
    real r = (1.0f - t) * spectrum_mean(m.specular_reflectance), d = t * spectrum_mean(m.diffuse_reflectance);
    return sel(r + d > 0.0f, r / max_r(r + d, (real)(1e-20f)), (real)(0.5f));
}

/* The base, but for T(wo) T(wi): pi f. */
inline Spectrum rough_plastic_base(RoughPlastic m, Microfacets d, Spectrum eta)
{
    Spectrum inside = coat_inside_reflectance_spectrum(d, eta), r;
    mask nonlinear = m.nonlinear != 0;
#define C(c)                                                           \
    inside.c *= sel(nonlinear, m.diffuse_reflectance.c, (real)(1.0f)); \
    r.c = m.diffuse_reflectance.c / (eta.c * eta.c * (1.0f - inside.c));
    SPECTRUM_EACH(C)
#undef C
    return r;
}

/* eval and pdf, given T(wo). */
inline Spectrum rough_plastic_value(RoughPlastic m, vec3 wo, vec3 wi, Spectrum t_wo)
{
    Microfacets d = rough_plastic_facets(m);
    Spectrum eta = relative_index(m.int_ior, m.ext_ior);
    vec3 h = normalize3(add3(wo, wi));
    real g = microfacet_g1(d, wo, h) * microfacet_g1(d, wi, h);
    real v = microfacet_d(d, h) * g / max_r(4.0f * wo.z, (real)(1e-20f));
    Spectrum f = fresnel_spectrum(clamp_r(dot3(wo, h), (real)(0.0f), (real)(1.0f)), eta);
    Spectrum coat = spectrum_scale(spectrum_mul(m.specular_reflectance, f), v);
    Spectrum passed = spectrum_mul(t_wo, coat_transmittance_spectrum(d, fabs(wi.z), eta));
    Spectrum r = spectrum_mul(rough_plastic_base(m, d, eta), passed);
    mask front = (wo.z > 0.0f) & (wi.z > 0.0f);
    return spectrum_sel(front, spectrum_madd(r, wi.z * INV_PI, coat), spectrum_of(0.0f));
}
inline real rough_plastic_density(RoughPlastic m, vec3 wo, vec3 wi, real t_wo)
{
    Microfacets d = rough_plastic_facets(m);
    vec3 h = normalize3(add3(wo, wi));
    real p = rough_plastic_coat_probability(m, t_wo);
    real coat = microfacet_visible_pdf(d, wo, h) / max_r(4.0f * dot3(wo, h), (real)(1e-20f));
    real pdf = p * coat + (1.0f - p) * cosine_hemisphere_pdf(wi.z);
    return sel((wo.z > 0.0f) & (wi.z > 0.0f), pdf, (real)(0.0f));
}

Spectrum rough_plastic_eval(RoughPlastic m, vec3 wo, vec3 wi)
{
    Spectrum eta = relative_index(m.int_ior, m.ext_ior);
    Spectrum t = coat_transmittance_spectrum(rough_plastic_facets(m), fabs(wo.z), eta);
    return rough_plastic_value(m, wo, wi, t);
}

real rough_plastic_pdf(RoughPlastic m, vec3 wo, vec3 wi)
{
    Spectrum eta = relative_index(m.int_ior, m.ext_ior);
    Spectrum t = coat_transmittance_spectrum(rough_plastic_facets(m), fabs(wo.z), eta);
    return rough_plastic_density(m, wo, wi, spectrum_mean(t));
}

BsdfSample rough_plastic_sample(RoughPlastic m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    Microfacets d = rough_plastic_facets(m);
    Spectrum t = coat_transmittance_spectrum(d, fabs(wo.z), relative_index(m.int_ior, m.ext_ior));
    vec2 uv = {u.x, u.y};
    vec3 mirrored = reflect_at(wo, microfacet_visible(d, wo, uv));
    real t_mean = spectrum_mean(t);
    s.wi = sel3(u.z < rough_plastic_coat_probability(m, t_mean), mirrored, cosine_hemisphere(uv));
    s.pdf = rough_plastic_density(m, wo, s.wi, t_mean);
    Spectrum f = rough_plastic_value(m, wo, s.wi, t);
    s.weight = spectrum_scale(f, sel(s.pdf > 0.0f, 1.0f / s.pdf, (real)(0.0f)));
    return s;
}

Spectrum rough_plastic_albedo(RoughPlastic m) { return m.diffuse_reflectance; }

DiffuseLobe rough_plastic_diffuse_lobe(RoughPlastic m, vec3 wo)
{
    DiffuseLobe lobe;
    Microfacets d = rough_plastic_facets(m);
    Spectrum eta = relative_index(m.int_ior, m.ext_ior);
    lobe.value = rough_plastic_base(m, d, eta);
    Spectrum t = coat_transmittance_spectrum(d, fabs(wo.z), eta);
    lobe.other = rough_plastic_coat_probability(m, spectrum_mean(t));
    lobe.eta = sel(spectrum_varies(eta), (real)(-1.0f), eta.x);
    lobe.alpha = sel(d.beckmann, -d.alpha_u, d.alpha_u);
    return lobe;
}
