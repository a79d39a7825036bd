/* Smooth boundary of two dielectrics, both sides: mirror reflection and refraction by Snell's law,
 * chosen by the mean of the boundary's reflectance at the path's wavelengths. Radiance that is
 * refracted is scaled by 1 / eta^2. Thin films on the boundary change no direction: their faces are parallel. */
#include "materials/fresnel.cl"

BsdfSample dielectric_sample(Dielectric m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    Spectrum eta = relative_index(m.int_ior, m.ext_ior);
    Fresnel hero = fresnel_dielectric(wo.z, eta.x);
    Boundary b = dielectric_boundary(m.layers, wo.z, eta, m.ext_ior);
    mask reflected = u.z < b.p;
    real scale = -1.0f / hero.eta;
    vec3 refracted = v3(wo.x * scale, wo.y * scale, hero.cos_t);
    Spectrum r = spectrum_mul(m.specular_reflectance, b.r);
    Spectrum t = spectrum_scale(spectrum_mul(m.specular_transmittance, b.t), scale * scale);
    s.wi = sel3(reflected, reflect_z(wo), normalize3(refracted));
    real chosen = sel(reflected, b.p, 1.0f - b.p);
    s.weight = spectrum_scale(spectrum_sel(reflected, r, t), 1.0f / chosen);
    s.pdf = sel(reflected | (hero.cos_t != 0.0f), chosen, (real)(0.0f)); /* the hero alone may be reflected totally */
    s.eta = sel(reflected, (real)(1.0f), hero.eta);
    integer disperse = sel_i(spectrum_varies(eta), (integer)(LOBE_DISPERSE), (integer)(0));
    s.lobe = sel_i(reflected, (integer)(LOBE_REFLECT), LOBE_TRANSMIT | disperse) | LOBE_DELTA;
    return s;
}

Spectrum dielectric_eval(Dielectric m, vec3 wo, vec3 wi) { return spectrum_of(0.0f); }

real dielectric_pdf(Dielectric m, vec3 wo, vec3 wi) { return 0.0f; }

Spectrum dielectric_albedo(Dielectric m) { return m.specular_transmittance; }
