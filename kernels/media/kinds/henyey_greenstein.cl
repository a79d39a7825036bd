/* Henyey and Greenstein 1941: (1 - g^2) / (4 pi (1 + g^2 - 2 g cos)^1.5), cos of the scattering angle. It is
 * sampled by the inverse of its integral (Pharr, Jakob and Humphreys 2023, 11.3.1). */
#include "media/phase.cl"

Spectrum henyey_greenstein_eval(HenyeyGreenstein m, vec3 wo, vec3 wi)
{
    real turn = -dot3(wo, wi);
    Spectrum r;
#define C(c) r.c = hg_density(m.g.c, turn);
    SPECTRUM_EACH(C)
#undef C
    return r;
}

Spectrum henyey_greenstein_pdfs(HenyeyGreenstein m, vec3 wo, vec3 wi) { return henyey_greenstein_eval(m, wo, wi); }

real henyey_greenstein_pdf(HenyeyGreenstein m, vec3 wo, vec3 wi)
{
    return phase_pdf(henyey_greenstein_eval(m, wo, wi), phase_same(m.g));
}

BsdfSample henyey_greenstein_sample(HenyeyGreenstein m, vec3 wo, vec3 u)
{
    mask same = phase_same(m.g);
    integer component = phase_component(same, &u.x);
    BsdfSample s = phase_turned(hg_turn(phase_part(m.g, component), u.x), u.y);
    return phase_weighed(s, henyey_greenstein_eval(m, wo, s.wi), same);
}

Spectrum henyey_greenstein_albedo(HenyeyGreenstein m) { return spectrum_of(1.0f); }
