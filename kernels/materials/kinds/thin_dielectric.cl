/* A thin slab, both sides: it reflects a share, and transmits the remainder undeviated. */
#include "materials/fresnel.cl#thin_slab"

BsdfSample thin_dielectric_sample(ThinDielectric m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    Spectrum f = thin_slab_reflected(fabs(wo.z), relative_index(m.int_ior, m.ext_ior));
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
