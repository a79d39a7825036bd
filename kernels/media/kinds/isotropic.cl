/* The same in all directions: 1 / (4 pi). */
#include "media/phase.cl"

BsdfSample isotropic_sample(Isotropic m, vec3 wo, vec3 u) { return phase_uniform(u, spectrum_of(1.0f)); }

Spectrum isotropic_eval(Isotropic m, vec3 wo, vec3 wi) { return spectrum_of(0.25f * INV_PI); }

real isotropic_pdf(Isotropic m, vec3 wo, vec3 wi) { return 0.25f * INV_PI; }

Spectrum isotropic_albedo(Isotropic m) { return spectrum_of(1.0f); }
