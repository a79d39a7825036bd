/* The principled model of thin sheets, as Mitsuba 3 defines it (Burley 2015): diffuse reflection and
 * transmission, and a rough dielectric slab that does not bend light; both sides alike. f [1/sr]. What
 * passes the slab is a reflection, turned to the other side, of facets whose roughness grows with the
 * index (Burley 2015, fig. 15); directions are sampled by the mean index. */
#include "materials/principled.cl"

/* A pair of directions, turned so that wo is on the front. */
typedef struct {
    vec3 wo, wi, h; /* h: of wo and of wi, or wi's mirror image on the front */
    mask crossed, shading;
} ThinPair;

/* Those that light meets, by the index of the slab. */
inline Microfacets principled_thin_facets(PrincipledThin m, mask crossed, real eta)
{
    real scale = 0.65f * eta - 0.35f;
    return principled_facets(m.roughness * sel(crossed, scale, (real)(1.0f)), m.anisotropic);
}
inline ThinPair principled_thin_pair(PrincipledThin m, vec3 wo, vec3 wi)
{
    ThinPair p;
    real side = sel(wo.z < 0.0f, (real)(-1.0f), (real)(1.0f));
    p.wo = scale3(wo, side);
    p.wi = scale3(wi, side);
    p.crossed = p.wi.z < 0.0f;
    p.h = normalize3(add3(p.wo, v3(p.wi.x, p.wi.y, fabs(p.wi.z))));
    p.shading = (dot3(p.wo, p.h) > 0.0f) & (dot3(p.wi, p.h) * p.wi.z > 0.0f);
    return p;
}

/* Density of wi as a microfacet's reflection, perhaps turned. */
inline real principled_thin_lobe(ThinPair p, Microfacets d)
{
    real v = microfacet_visible_pdf(d, p.wo, p.h) / max_r(4.0f * dot3(p.wo, p.h), (real)(1e-20f));
    return sel(p.shading, v, (real)(0.0f));
}

/* The slab's f |cos| where its facets reflect all. */
inline real principled_thin_slab(PrincipledThin m, ThinPair p, real eta)
{
    Microfacets d = principled_thin_facets(m, p.crossed, eta);
    return principled_thin_lobe(p, d) * microfacet_g1(d, p.wi, p.h) * m.spec_trans;
}

Spectrum principled_thin_eval(PrincipledThin m, vec3 wo, vec3 wi)
{
    ThinPair p = principled_thin_pair(m, wo, wi);
    real through = 0.5f * m.diff_trans, cos_o = p.wo.z, cos_i = fabs(p.wi.z);
    real c = dot3(p.h, p.wo);
    Spectrum lobe = spectrum_of(principled_thin_slab(m, p, m.eta.x));
    if (any(spectrum_varies(m.eta))) {
#define C(c_) lobe.c_ = principled_thin_slab(m, p, m.eta.c_);
        SPECTRUM_EACH(C)
#undef C
    }
    Spectrum f = fresnel_spectrum(min_r(c, (real)(1.0f)), m.eta), weight, slab, base;
    Spectrum tint = principled_tint(m.base_color, m.luminance), one = spectrum_of(1.0f);
#define C(c_) weight.c_ = schlick_boundary(c, max_r(m.eta.c_, (real)(0.01f)));
    SPECTRUM_EACH(C)
#undef C
    slab = principled_fresnel(f, m.eta, weight, tint, m.spec_tint);
    slab = spectrum_sel(p.crossed, spectrum_mul(m.base_color, spectrum_sub(one, f)), slab);
    real reflected = principled_diffuse(cos_o, cos_i, c, m.roughness, m.flatness) * (1.0f - through);
    base = spectrum_scale(m.base_color, sel(p.crossed, through, reflected) * INV_PI);
    real sheen = sel(p.crossed, (real)(0.0f), m.sheen * (1.0f - through));
    base = spectrum_madd(principled_sheen(tint, m.sheen_tint, c), sheen, base);
    mask usable = (cos_o > 0.0f) & (cos_i > 0.0f);
    base = spectrum_add(spectrum_mul(slab, lobe), spectrum_scale(base, (1.0f - m.spec_trans) * cos_i));
    return spectrum_sel(usable, base, spectrum_of(0.0f));
}

real principled_thin_pdf(PrincipledThin m, vec3 wo, vec3 wi)
{
    ThinPair p = principled_thin_pair(m, wo, wi);
    Microfacets d = principled_thin_facets(m, p.crossed, spectrum_mean(m.eta));
    real through = 0.5f * m.diff_trans, cos_i = fabs(p.wi.z);
    real diffuse = sel(p.crossed, through, 1.0f - through) * cosine_hemisphere_pdf(cos_i);
    real pdf = diffuse * (1.0f - m.spec_trans) + principled_thin_lobe(p, d) * 0.5f * m.spec_trans;
    return sel((p.wo.z > 0.0f) & (cos_i > 0.0f), pdf, (real)(0.0f));
}

BsdfSample principled_thin_sample(PrincipledThin m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    vec2 uv = {u.x, u.y};
    real side = sel(wo.z < 0.0f, (real)(-1.0f), (real)(1.0f)), half_spec = 0.5f * m.spec_trans;
    mask specular = u.z < m.spec_trans;
    real diffuse = m.spec_trans + (1.0f - m.spec_trans) * (1.0f - 0.5f * m.diff_trans);
    mask crossed = (specular & (u.z >= half_spec)) | (!specular & (u.z >= diffuse));
    s.wi = cosine_hemisphere(uv);
    if (any(specular)) {
        Microfacets d = principled_thin_facets(m, crossed, spectrum_mean(m.eta));
        vec3 front = scale3(wo, side), h = microfacet_visible(d, front, uv);
        s.wi = sel3(specular, reflect_at(front, h), s.wi);
    }
    mask kept = s.wi.z > 0.0f;
    s.wi.z *= sel(crossed, (real)(-1.0f), (real)(1.0f));
    s.wi = scale3(s.wi, side);
    kept = kept & (!specular | principled_thin_pair(m, wo, s.wi).shading);
    s.pdf = sel(kept, principled_thin_pdf(m, wo, s.wi), (real)(0.0f));
    Spectrum f = principled_thin_eval(m, wo, s.wi);
    s.weight = spectrum_scale(f, sel(s.pdf > 0.0f, 1.0f / s.pdf, (real)(0.0f)));
    s.lobe = sel_i(crossed, (integer)(LOBE_TRANSMIT), (integer)(LOBE_REFLECT));
    return s;
}

Spectrum principled_thin_albedo(PrincipledThin m) { return m.base_color; }
