/* Smooth metal, front side: mirror reflection, Fresnel's reflectance of the index eta + i k, or
 * that of the thin films on it. */
#include "materials/fresnel.cl"

BsdfSample conductor_sample(Conductor m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    s.wi = reflect_z(wo);
    s.weight = spectrum_mul(m.specular_reflectance, conductor_boundary(m.layers, fabs(wo.z), m.eta, m.k));
    s.pdf = sel(wo.z > 0.0f, (real)(1.0f), (real)(0.0f));
    s.lobe = LOBE_REFLECT | LOBE_DELTA;
    return s;
}

Spectrum conductor_eval(Conductor m, vec3 wo, vec3 wi) { return spectrum_of(0.0f); }

real conductor_pdf(Conductor m, vec3 wo, vec3 wi) { return 0.0f; }

Spectrum conductor_albedo(Conductor m)
{
    return spectrum_mul(m.specular_reflectance, conductor_boundary(m.layers, (real)(1.0f), m.eta, m.k));
}
