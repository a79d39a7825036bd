/* Rayleigh 1871: 3 (1 + cos^2) / 16 pi. The cosine is the root of a cubic equation (Frisvad 2011, eq. 6). */
#include "media/phase.cl"

real rayleigh_pdf(Rayleigh m, vec3 wo, vec3 wi)
{
    real turn = dot3(wo, wi);
    return (3.0f / 16.0f) * INV_PI * (1.0f + turn * turn);
}

Spectrum rayleigh_eval(Rayleigh m, vec3 wo, vec3 wi) { return spectrum_of(rayleigh_pdf(m, wo, wi)); }

BsdfSample rayleigh_sample(Rayleigh m, vec3 wo, vec3 u)
{
    real v = 4.0f * u.x - 2.0f, root = v + sqrt(v * v + 1.0f);
    real a = pow_r(root, (real)(1.0f / 3.0f));
    BsdfSample s = phase_turned(clamp_r(1.0f / a - a, (real)(-1.0f), (real)(1.0f)), u.y);
    s.weight = spectrum_of(1.0f);
    s.pdf = rayleigh_pdf(m, wo, s.wi);
    return s;
}

Spectrum rayleigh_albedo(Rayleigh m) { return spectrum_of(1.0f); }
