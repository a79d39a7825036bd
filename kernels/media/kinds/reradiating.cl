/* Isotropic; materials/reradiation.cl chooses the incident wavelengths, as for materials/kinds/fluorescent.cl. A
 * point of a medium has no normal, so f = (reflectance + glow) / 4 pi [1/sr]. */
#include "materials/glow.cl"
#include "media/phase.cl"

Spectrum reradiating_albedo(Reradiating m) { return with_glow(m.reflectance, m.reradiation, m.amount); }

BsdfSample reradiating_sample(Reradiating m, vec3 wo, vec3 u) { return phase_uniform(u, reradiating_albedo(m)); }

Spectrum reradiating_eval(Reradiating m, vec3 wo, vec3 wi)
{
    return spectrum_scale(reradiating_albedo(m), 0.25f * INV_PI);
}

real reradiating_pdf(Reradiating m, vec3 wo, vec3 wi) { return 0.25f * INV_PI; }
