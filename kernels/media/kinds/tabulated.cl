/* A table over the cosine of the scattering angle, linear between its points. It is sampled by the exact inverse of its
 * integral. */
#include "media/phase.cl"

Spectrum tabulated_eval(Tabulated m, vec3 wo, vec3 wi) { return angular_density(m.values, -dot3(wo, wi)); }

Spectrum tabulated_pdfs(Tabulated m, vec3 wo, vec3 wi) { return tabulated_eval(m, wo, wi); }

real tabulated_pdf(Tabulated m, vec3 wo, vec3 wi)
{
    return phase_pdf(tabulated_eval(m, wo, wi), phase_same(m.values.row));
}

BsdfSample tabulated_sample(Tabulated m, vec3 wo, vec3 u)
{
    mask same = phase_same(m.values.row);
    integer component = phase_component(same, &u.x);
    BsdfSample s = phase_turned(angular_sample(m.values, phase_part(m.values.row, component), u.x), u.y);
    return phase_weighed(s, tabulated_eval(m, wo, s.wi), same);
}

Spectrum tabulated_albedo(Tabulated m) { return spectrum_of(1.0f); }
