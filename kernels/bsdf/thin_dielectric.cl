/* A thin slab, both sides: the reflections between its two faces add up to 2 F / (1 + F), the rest
 * passes undeviated (Stokes 1862; without interference). */
#include "optics/fresnel.cl"

inline Spectrum thin_dielectric_reflected(Spectrum f)
{
    Spectrum r;
#define C(c) r.c = 2.0f * f.c / (1.0f + f.c);
    SPECTRUM_EACH(C)
#undef C
    return r;
}

BsdfSample thin_dielectric_sample(ThinDielectric m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    Spectrum eta = relative_index(m.int_ior, m.ext_ior);
    Spectrum f = thin_dielectric_reflected(fresnel_spectrum(fabs(wo.z), eta));
    real p = spectrum_mean(f);
    mask reflected = u.z < p;
    Spectrum r = spectrum_mul(m.specular_reflectance, f);
    Spectrum t = spectrum_mul(m.specular_transmittance, spectrum_sub(spectrum_of(1.0f), f));
    s.wi = sel3(reflected, reflect_z(wo), neg3(wo));
    s.pdf = sel(reflected, p, 1.0f - p);
    s.weight = spectrum_scale(spectrum_sel(reflected, r, t), 1.0f / s.pdf);
    s.lobe = sel_i(reflected, (integer)(LOBE_REFLECT), (integer)(LOBE_TRANSMIT)) | LOBE_DELTA;
    return s;
}

Spectrum thin_dielectric_eval(ThinDielectric m, vec3 wo, vec3 wi) { return spectrum_of(0.0f); }

real thin_dielectric_pdf(ThinDielectric m, vec3 wo, vec3 wi) { return 0.0f; }

Spectrum thin_dielectric_albedo(ThinDielectric m) { return m.specular_transmittance; }
