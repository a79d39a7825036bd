/* A table that MERL measured (Matusik et al. 2003), front side: f [1/sr] is linear between its centres. Light is
 * sampled by the table itself: by a warp to halfway directions, made of f cos at sixteen angles of the viewer. Of
 * red, green and blue the mean counts, so that no pdf depends on the wavelength. */
#include "materials/merl_table.cl"

typedef struct {
    MerlParts parts;
    WarpSlices viewers;
    real turned; /* azimuth of wo, in full turns */
} MerlView;

inline MerlView merl_view(MerlTable t, vec3 wo)
{
    MerlView v;
    v.parts = merl_parts(t);
    v.viewers = merl_viewers(v.parts, atan2_r(sqrt_r(wo.x * wo.x + wo.y * wo.y), wo.z));
    v.turned = atan2_r(wo.y, wo.x) * INV_2PI;
    return v;
}

BsdfSample merl_sample(Merl m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    MerlView v = merl_view(m.data, wo);
    vec2 uv = {u.y, u.x};
    real density;
    vec2 p = warp_sample(v.parts.warp, v.viewers, uv, &density);
    vec3 h = halfway_direction(p, v.turned);
    real cos_o = dot3(wo, h);
    s.wi = normalize3(sub3(scale3(h, 2.0f * cos_o), wo));
    s.pdf = density / halfway_area(p.x, h, cos_o);
    mask seen = (wo.z > 0.0f) & (s.wi.z > 0.0f) & (cos_o > 0.0f) & (s.pdf > 0.0f);
    vec3 f = merl_f(m.data, v.parts, h, wo, s.wi);
    s.weight = spectrum_scale(merl_spectrum(m.data, f), s.wi.z / max_r(s.pdf, (real)(1e-30f)));
    s.pdf = sel(seen, s.pdf, (real)(0.0f));
    return s;
}

Spectrum merl_eval(Merl m, vec3 wo, vec3 wi)
{
    vec3 f = merl_f(m.data, merl_parts(m.data), normalize3(add3(wo, wi)), wo, wi);
    mask front = (wo.z > 0.0f) & (wi.z > 0.0f);
    return spectrum_scale(merl_spectrum(m.data, f), sel(front, wi.z, (real)(0.0f)));
}

real merl_pdf(Merl m, vec3 wo, vec3 wi)
{
    MerlView v = merl_view(m.data, wo);
    vec3 h = normalize3(add3(wo, wi));
    vec2 p = halfway_square(h);
    p.y -= v.turned;
    p.y -= floor(p.y);
    real density = warp_density(v.parts.warp, v.viewers, p) / halfway_area(p.x, h, dot3(wo, h));
    return sel((wo.z > 0.0f) & (wi.z > 0.0f), density, (real)(0.0f));
}

Spectrum merl_albedo(Merl m)
{
    integer at = m.data.first + 6;
    return merl_spectrum(m.data, gather3(m.data.values, at));
}
