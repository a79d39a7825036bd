/* A diffuse base under a smooth dielectric coat, front side. Light enters and leaves the coat by
 * Fresnel's transmittance; what the coat reflects back inside falls on the base again and again, a
 * geometric series. Diffuse part: f = (1 - F(wo)) (1 - F(wi)) d / (pi eta^2 (1 - d' Fdr)), where d'
 * is d or, if the colour is kept linear, 1 [1/sr]. */
#include "materials/fresnel.cl"

/* The probability of the coat's mirror reflection, from the two parts' strengths. */
inline real plastic_mirror_probability(Plastic m, real f)
{
    real r = f * spectrum_mean(m.specular_reflectance);
    real d = (1.0f - f) * spectrum_mean(m.diffuse_reflectance);
    return sel(r + d > 0.0f, r / max_r(r + d, (real)(1e-20f)), f);
}

/* The base as seen through the coat, but for the transmittance on the way out: pi f / (1 - F(wi)). */
inline Spectrum plastic_base(Plastic m, Spectrum eta, Spectrum f_wo)
{
    Spectrum r;
    mask nonlinear = m.nonlinear != 0;
#define C(c)                                                                  \
    real CAT(inside_, c) = fresnel_diffuse(1.0f / eta.c);                     \
    CAT(inside_, c) *= sel(nonlinear, m.diffuse_reflectance.c, (real)(1.0f)); \
    r.c = m.diffuse_reflectance.c * (1.0f - f_wo.c) / (eta.c * eta.c * (1.0f - CAT(inside_, c)));
    SPECTRUM_EACH(C)
#undef C
    return r;
}

BsdfSample plastic_sample(Plastic m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    Spectrum eta = relative_index(m.int_ior, m.ext_ior), one = spectrum_of(1.0f);
    Spectrum f = fresnel_spectrum(fabs(wo.z), eta);
    real p = plastic_mirror_probability(m, spectrum_mean(f));
    mask mirror = u.z < p;
    vec2 uv = {u.x, u.y};
    vec3 wi = cosine_hemisphere(uv);
    Spectrum out = spectrum_sub(one, fresnel_spectrum(wi.z, eta));
    Spectrum base = spectrum_mul(plastic_base(m, eta, f), out);
    Spectrum coat = spectrum_mul(m.specular_reflectance, f);
    s.wi = sel3(mirror, reflect_z(wo), wi);
    s.weight = spectrum_scale(spectrum_sel(mirror, coat, base), 1.0f / sel(mirror, p, 1.0f - p));
    s.pdf = sel(mirror, p, (1.0f - p) * cosine_hemisphere_pdf(wi.z));
    s.pdf = sel(wo.z > 0.0f, s.pdf, (real)(0.0f));
    s.lobe = LOBE_REFLECT | sel_i(mirror, (integer)(LOBE_DELTA), (integer)(0));
    return s;
}

Spectrum plastic_eval(Plastic m, vec3 wo, vec3 wi)
{
    Spectrum eta = relative_index(m.int_ior, m.ext_ior), one = spectrum_of(1.0f);
    mask front = (wo.z > 0.0f) & (wi.z > 0.0f);
    Spectrum base = plastic_base(m, eta, fresnel_spectrum(fabs(wo.z), eta));
    Spectrum out = spectrum_sub(one, fresnel_spectrum(fabs(wi.z), eta));
    return spectrum_scale(spectrum_mul(base, out), sel(front, wi.z * INV_PI, (real)(0.0f)));
}

real plastic_pdf(Plastic m, vec3 wo, vec3 wi)
{
    Spectrum eta = relative_index(m.int_ior, m.ext_ior);
    real p = plastic_mirror_probability(m, spectrum_mean(fresnel_spectrum(fabs(wo.z), eta)));
    return sel(wo.z > 0.0f, (1.0f - p) * cosine_hemisphere_pdf(wi.z), (real)(0.0f));
}

Spectrum plastic_albedo(Plastic m) { return m.diffuse_reflectance; }

DiffuseLobe plastic_diffuse_lobe(Plastic m, vec3 wo)
{
    DiffuseLobe lobe;
    Spectrum eta = relative_index(m.int_ior, m.ext_ior);
    lobe.value = plastic_base(m, eta, spectrum_of(0.0f));
    lobe.other = plastic_mirror_probability(m, spectrum_mean(fresnel_spectrum(fabs(wo.z), eta)));
    lobe.eta = sel(spectrum_varies(eta), (real)(-1.0f), eta.x);
    lobe.alpha = 0.0f;
    return lobe;
}
