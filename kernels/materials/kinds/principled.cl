/* The principled model, as Mitsuba 3 defines it (Burley 2012 and 2015): a blend of a diffuse base with
 * sheen, a rough metal of the base's colour and a rough dielectric, under a clearcoat. Front side; both
 * sides where light is let through. f [1/sr]. With a dispersive index each wavelength is refracted with
 * a half vector of its own; directions are sampled for the hero. */
#include "materials/principled.cl"
#include "materials/microfacet.cl#refracting"

/* The index, kept away from 1 where light is refracted: h would be undefined. */
inline Spectrum principled_index(Principled m)
{
    Spectrum eta = relative_index(m.eta, spectrum_of(1.0f));
#define C(c)                             \
    eta.c = max_r(eta.c, (real)(0.01f)); \
    eta.c = sel((m.spec_trans > 0.0f) & (fabs(eta.c - 1.0f) < 1e-3f), (real)(1.001f), eta.c);
    SPECTRUM_EACH(C)
#undef C
    return eta;
}
inline real principled_base(Principled m) { return (1.0f - m.metallic) * (1.0f - m.spec_trans); }
inline real principled_passed(Principled m) { return (1.0f - m.metallic) * m.spec_trans; }

/* The clearcoat's normals, GTR1 (Burley 2012 eq. 4), its masking that of roughness 1/4. */
inline real principled_coat_alpha2(Principled m) { return sqr(0.1f + (0.001f - 0.1f) * m.clearcoat_gloss); }
inline real principled_coat_d(Principled m, vec3 h)
{
    real a2 = principled_coat_alpha2(m), s2 = sqr(h.x) + sqr(h.y);
    return (a2 - 1.0f) / (PI * log_r(a2) * max_r(s2 + a2 * sqr(h.z), (real)(1e-12f)));
}
inline vec3 principled_coat_normal(Principled m, vec2 u)
{
    real a2 = principled_coat_alpha2(m), s, c;
    real cos2 = (1.0f - exp_r((1.0f - u.x) * log_r(a2))) / (1.0f - a2), r = sqrt_r(1.0f - cos2);
    sincos_2pi(u.y, &s, &c);
    return v3(r * c, r * s, sqrt_r(cos2));
}

/* Probabilities of the lobes, where a facet reflects the share f. */
typedef struct { real diffuse, coat, reflect, transmit; } PrincipledLobes;
inline PrincipledLobes principled_lobes(Principled m, vec3 wo, real f)
{
    mask front = wo.z > 0.0f;
    real passed = principled_passed(m), base = principled_base(m), coat = 0.25f * m.clearcoat;
    real total = 1.0f + base + coat, behind = sel(passed > 0.0f, (real)(1.0f), (real)(0.0f));
    PrincipledLobes p;
    p.diffuse = sel(front, base / total, (real)(0.0f));
    p.coat = sel(front, coat / total, (real)(0.0f));
    p.reflect = sel(front, (1.0f - passed * (1.0f - f)) / total, f * behind);
    p.transmit = sel(front, passed * (1.0f - f) / total, (1.0f - f) * behind);
    return p;
}

/* The facet between two directions, by reflection, or by transmission at an index. */
inline RefractingFacet principled_facet(vec3 wo, vec3 wi, real index)
{
    real eta = 1.0f;
    if (USES_PRINCIPLED_SPEC_TRANS) eta = sel(wo.z * wi.z < 0.0f, sel(wo.z > 0.0f, index, 1.0f / index), eta);
    return refracting_facet(wo, wi, eta);
}

/* f |cos| of reflection; f: reflectance of the facet p; facets: f |cos| of a perfect mirror there. */
inline Spectrum principled_reflected(Principled m, RefractingFacet p, Spectrum f, real facets, vec3 wo, vec3 wi,
                                     Spectrum eta)
{
    mask front = wo.z > 0.0f;
    Spectrum weight = schlick_boundary_spectrum(fabs(p.o), eta);
    Spectrum tint = principled_tint(m.base_color, m.luminance);
    mask reflects = spectrum_max(f) > 0.0f;
    Spectrum metal = schlick_spectrum(m.base_color, weight);
    Spectrum share = principled_fresnel(f, eta, weight, tint, m.spec_tint);
    share = spectrum_madd(spectrum_sub(metal, share), m.metallic, share);
    share = spectrum_sel(front, share, spectrum_scale(f, principled_passed(m)));
    Spectrum v = spectrum_scale(share, sel(reflects, facets, (real)(0.0f)));

    real cos_o = fabs(wo.z), cos_i = fabs(wi.z), c = dot3(p.h, wi);
    real base = principled_diffuse(cos_o, cos_i, c, m.roughness, m.flatness) * principled_base(m) * INV_PI;
    Spectrum below = spectrum_scale(m.base_color, base);
    if (USES_PRINCIPLED_SHEEN)
        below = spectrum_madd(principled_sheen(tint, m.sheen_tint, c), m.sheen * (1.0f - m.metallic), below);
    if (USES_PRINCIPLED_CLEARCOAT) {
        Microfacets masking = microfacets_of((integer)(0), (real)(0.25f), (real)(0.25f));
        real coat = 0.25f * m.clearcoat * (0.04f + 0.96f * weight.x) * principled_coat_d(m, p.h)
                  * microfacet_g1(masking, wo, p.h) * microfacet_g1(masking, wi, p.h);
        below = spectrum_add(below, spectrum_of(sel(p.shading, coat, (real)(0.0f))));
    }
    return spectrum_madd(below, sel(front, cos_i, (real)(0.0f)), v);
}

Spectrum principled_eval(Principled m, vec3 wo, vec3 wi)
{
    Microfacets d = principled_facets(m.roughness, m.anisotropic);
    Spectrum eta = principled_index(m);
    RefractingFacet p = principled_facet(wo, wi, eta.x);
    real facets = microfacet_visible_pdf(d, wo, p.h) * p.jacobian * microfacet_g1(d, wi, p.h);
    facets = sel(p.shading, facets, (real)(0.0f));
    Spectrum f = fresnel_spectrum(p.o, eta), v = principled_reflected(m, p, f, facets, wo, wi, eta);
    mask reflected = wo.z * wi.z > 0.0f, transmitted = wo.z * wi.z < 0.0f;
    v = spectrum_sel(reflected, v, spectrum_of(0.0f));
    if (USES_PRINCIPLED_SPEC_TRANS) {
        real passed = principled_passed(m);
        Spectrum t;
#define C(c) t.c = facets * (1.0f - f.c) * sel(wo.z > 0.0f, 1.0f / sqr(eta.c), sqr(eta.c));
        SPECTRUM_EACH(C)
#undef C
        if (any(spectrum_varies(eta))) {
#define C(c) t.c = refracting_facet_transmitted(d, wo, wi, eta.c);
            SPECTRUM_EACH(C)
#undef C
        }
#define C(c) v.c = sel(transmitted, t.c * passed * sqrt_r(m.base_color.c), v.c);
        SPECTRUM_EACH(C)
#undef C
    }
    return v;
}

/* pdf for a hero with this index. */
inline real principled_density(Principled m, vec3 wo, vec3 wi, real index)
{
    Microfacets d = principled_facets(m.roughness, m.anisotropic);
    mask reflected = wo.z * wi.z > 0.0f, crossed = wo.z * wi.z < 0.0f;
    RefractingFacet p = principled_facet(wo, wi, index);
    PrincipledLobes lobes = principled_lobes(m, wo, fresnel_dielectric(p.o, index).f);
    real facets = sel(crossed, lobes.transmit, lobes.reflect) * microfacet_visible_pdf(d, wo, p.h);
    if (USES_PRINCIPLED_CLEARCOAT) {
        real coat = lobes.coat * principled_coat_d(m, p.h) * p.h.z;
        facets += sel(reflected, coat, (real)(0.0f));
    }
    facets *= p.jacobian;
    real pdf = sel(p.shading, facets, (real)(0.0f));
    pdf += sel(reflected, lobes.diffuse * cosine_hemisphere_pdf(wi.z), (real)(0.0f));
    return sel(reflected | crossed, pdf, (real)(0.0f));
}

Spectrum principled_pdfs(Principled m, vec3 wo, vec3 wi)
{
    Spectrum eta = principled_index(m), v = spectrum_of(principled_density(m, wo, wi, eta.x));
    if (any(spectrum_varies(eta))) {
#define C(c) v.c = principled_density(m, wo, wi, eta.c);
        SPECTRUM_EACH(C)
#undef C
    }
    return v;
}

real principled_pdf(Principled m, vec3 wo, vec3 wi)
{
    return principled_density(m, wo, wi, principled_index(m).x);
}

BsdfSample principled_sample(Principled m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    Microfacets d = principled_facets(m.roughness, m.anisotropic);
    vec2 uv = {u.x, u.y};
    vec3 h = microfacet_visible(d, scale3(wo, sel(wo.z < 0.0f, (real)(-1.0f), (real)(1.0f))), uv);
    Fresnel f = fresnel_dielectric(dot3(wo, h), principled_index(m).x);
    PrincipledLobes p = principled_lobes(m, wo, f.f);
    mask diffuse = u.z < p.diffuse, coat = !diffuse & (u.z < p.diffuse + p.coat);
    mask crossed = !diffuse & !coat & (m.spec_trans > 0.0f) & (u.z < p.diffuse + p.coat + p.transmit);
    if (any(coat)) h = sel3(coat, principled_coat_normal(m, uv), h);
    s.wi = reflect_at(wo, h);
    if (any(crossed)) {
        vec3 refracted = sub3(scale3(h, dot3(wo, h) / f.eta + f.cos_t), scale3(wo, 1.0f / f.eta));
        s.wi = sel3(crossed, normalize3(refracted), s.wi);
    }
    s.wi = sel3(diffuse, cosine_hemisphere(uv), s.wi);
    mask kept = sel_i(crossed, wo.z * s.wi.z < 0.0f, wo.z * s.wi.z > 0.0f) != 0;
    s.pdf = sel(kept, principled_pdf(m, wo, s.wi), (real)(0.0f));
    s.weight = spectrum_scale(principled_eval(m, wo, s.wi), sel(s.pdf > 0.0f, 1.0f / s.pdf, (real)(0.0f)));
    s.eta = sel(crossed, f.eta, (real)(1.0f));
    s.lobe = sel_i(crossed, (integer)(LOBE_TRANSMIT), (integer)(LOBE_REFLECT));
    return s;
}

Spectrum principled_albedo(Principled m) { return m.base_color; }

real principled_across(Principled m) { return principled_index(m).x; }
