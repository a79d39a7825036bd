/* A thin slab, both sides: the reflections between its two faces add up to 2 F / (1 + F) in each
 * polarisation, and unpolarised light to the mean of both; the rest passes undeviated (Stokes 1862; without
 * interference). */
#include "optics/fresnel.cl"

inline real thin_dielectric_slab(real c, real eta)
{
    real cos2_t = 1.0f - (1.0f - c * c) / (eta * eta);
    vec2 f = fresnel_polarised(c, sqrt_r(cos2_t), eta);
    real r = f.x / (1.0f + f.x) + f.y / (1.0f + f.y);
    r = sel((cos2_t <= 0.0f) | (c == 0.0f), (real)(1.0f), r);
    return sel(eta == 1.0f, (real)(0.0f), r);
}
inline Spectrum thin_dielectric_reflected(real c, Spectrum eta)
{
    Spectrum r = spectrum_of(thin_dielectric_slab(c, eta.x));
    if (any(spectrum_varies(eta))) {
#define C(c_) r.c_ = thin_dielectric_slab(c, eta.c_);
        SPECTRUM_EACH(C)
#undef C
    }
    return r;
}

BsdfSample thin_dielectric_sample(ThinDielectric m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    Spectrum f = thin_dielectric_reflected(fabs(wo.z), relative_index(m.int_ior, m.ext_ior));
    real p = spectrum_mean(f);
    mask reflected = u.z < p;
    Spectrum r = spectrum_mul(m.specular_reflectance, f);
    Spectrum t = spectrum_mul(m.specular_transmittance, spectrum_sub(spectrum_of(1.0f), f));
    s.wi = sel3(reflected, reflect_z(wo), neg3(wo));
    s.pdf = sel(reflected, p, 1.0f - p);
    s.weight = spectrum_scale(spectrum_sel(reflected, r, t), 1.0f / s.pdf);
    s.lobe = sel_i(reflected, (integer)(LOBE_REFLECT), (integer)(LOBE_TRANSMIT | LOBE_NULL)) | LOBE_DELTA;
    return s;
}

Spectrum thin_dielectric_eval(ThinDielectric m, vec3 wo, vec3 wi) { return spectrum_of(0.0f); }

real thin_dielectric_pdf(ThinDielectric m, vec3 wo, vec3 wi) { return 0.0f; }

Spectrum thin_dielectric_albedo(ThinDielectric m) { return m.specular_transmittance; }
