/* A glossy coat over a diffuse base, front side (Ashikhmin and Shirley 2000), with GGX as in pbrt-v3's
 * FresnelBlend: f = 28 kd (1 - ks) / (23 pi) (1 - (1 - cos_i / 2)^5) (1 - (1 - cos_o / 2)^5)
 * + D F / (4 (wi.h) max(cos_i, cos_o)) [1/sr], F = ks + (1 - ks) (1 - wi.h)^5. */
#include "materials/microfacet.cl"

inline real ashikhmin_shirley_fifth(real x) { real a = max_r(x, (real)(0.0f)), b = a * a; return b * b * a; }

Spectrum ashikhmin_shirley_eval(AshikhminShirley m, vec3 wo, vec3 wi)
{
    Microfacets d = microfacets_of((integer)(0), m.alpha_u, m.alpha_v);
    vec3 h = normalize3(add3(wo, wi));
    real cos_h = max_r(dot3(wi, h), (real)(1e-7f)), grazing = ashikhmin_shirley_fifth(1.0f - cos_h);
    real base = (28.0f / (23.0f * PI)) * (1.0f - ashikhmin_shirley_fifth(1.0f - 0.5f * wi.z))
                * (1.0f - ashikhmin_shirley_fifth(1.0f - 0.5f * wo.z));
    real lobe = microfacet_d(d, h) / (4.0f * cos_h * max_r(max_r(wi.z, wo.z), (real)(1e-7f)));
    mask front = (wo.z > 0.0f) & (wi.z > 0.0f);
    real cosine = sel(front, wi.z, (real)(0.0f));
    Spectrum f;
    real specular = 1.0f - grazing;
#define C(c) f.c = cosine * (m.diffuse.c * (1.0f - m.specular.c) * base + lobe * (m.specular.c * specular + grazing));
    SPECTRUM_EACH(C)
#undef C
    return f;
}

real ashikhmin_shirley_pdf(AshikhminShirley m, vec3 wo, vec3 wi)
{
    Microfacets d = microfacets_of((integer)(0), m.alpha_u, m.alpha_v);
    vec3 h = normalize3(add3(wo, wi));
    real lobe = microfacet_visible_pdf(d, wo, h) / max_r(4.0f * dot3(wo, h), (real)(1e-20f));
    real pdf = 0.5f * (lobe + cosine_hemisphere_pdf(wi.z));
    return sel((wo.z > 0.0f) & (wi.z > 0.0f), pdf, (real)(0.0f));
}

BsdfSample ashikhmin_shirley_sample(AshikhminShirley m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    Microfacets d = microfacets_of((integer)(0), m.alpha_u, m.alpha_v);
    vec2 uv = {u.x, u.y};
    s.wi = sel3(u.z < 0.5f, reflect_at(wo, microfacet_visible(d, wo, uv)), cosine_hemisphere(uv));
    s.pdf = ashikhmin_shirley_pdf(m, wo, s.wi);
    s.weight = spectrum_scale(ashikhmin_shirley_eval(m, wo, s.wi), sel(s.pdf > 0.0f, 1.0f / s.pdf, (real)(0.0f)));
    return s;
}

Spectrum ashikhmin_shirley_albedo(AshikhminShirley m)
{
    Spectrum r;
#define C(c) r.c = m.specular.c + m.diffuse.c * (1.0f - m.specular.c);
    SPECTRUM_EACH(C)
#undef C
    return r;
}
