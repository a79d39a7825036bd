/* Lambertian paint that fluoresces: f = (reflectance + glow) / pi [1/sr], where glow is the integral
 * [1] of the re-radiation over the incident wavelengths, at the outgoing wavelengths (Donaldson 1954).
 * materials/reradiation.cl chooses the incident wavelengths, with probabilities that divide out. */
#include "materials/glow.cl"

Spectrum fluorescent_albedo(Fluorescent m) { return with_glow(m.reflectance, m.reradiation, m.amount); }

BsdfSample fluorescent_sample(Fluorescent m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    vec2 uv = {u.x, u.y};
    s.wi = cosine_hemisphere(uv);
    s.pdf = sel(wo.z > 0.0f, cosine_hemisphere_pdf(s.wi.z), (real)(0.0f));
    s.weight = fluorescent_albedo(m);
    return s;
}

Spectrum fluorescent_eval(Fluorescent m, vec3 wo, vec3 wi)
{
    mask front = (wo.z > 0.0f) & (wi.z > 0.0f);
    return spectrum_scale(fluorescent_albedo(m), sel(front, wi.z * INV_PI, (real)(0.0f)));
}

real fluorescent_pdf(Fluorescent m, vec3 wo, vec3 wi)
{
    return sel(wo.z > 0.0f, cosine_hemisphere_pdf(wi.z), (real)(0.0f));
}
