/* A rough metal under a rough, clear dielectric coat; front side. On top the coat's microfacets (Walter et al. 2007
 * eq. 20), below them the metal's, met by directions refracted at the smooth boundary: f = T(wo) T(wi) f_metal(wo',
 * wi') / eta^2 [1/sr], exact where the coat is smooth. A rough coat turns light by (1 - 1/eta) times its slopes:
 * their variance, times that squared and a factor of 2.5, fitted to random walks (tests/kernels/test_coated.py), is
 * added to the metal's. Light that the coat reflects back inside, tabulated by the incident cosine, is summed as a
 * geometric series: along the mirror direction, as between smooth boundaries, or, the rougher the metal, as diffuse
 * light like plastic's. Light that a rough metal sends beyond the critical angle tends to stay beyond it: `leaves`,
 * fitted to the same walks. A coat that disperses bends each wavelength by its own index; directions are sampled by
 * the mean of the four. */
#include "materials/fresnel.cl"
#include "materials/microfacet.cl"
#include "materials/rough_coat.cl"

typedef struct {
    Microfacets coat, metal, even; /* even: the metal's, as rough in all directions */
    real eta;          /* of the coat over what is outside */
    real bounce;       /* what leaves the metal's facets, if they reflect all */
    Spectrum again;    /* what comes of light that the coat throws back, as a diffuse albedo below it */
    real between;      /* share of it that stays in the mirror direction instead */
    real leaves;       /* share of it that leaves the coat at the next bounce, over that at this bounce */
} CoatedMetal;

/* Index and extinction of the metal over the coat's index. */
inline Spectrum coated_conductor_fresnel(CoatedConductor m, real cos_i)
{
    Spectrum eta = spectrum_div(m.eta, m.coat_ior), k = spectrum_div(m.k, m.coat_ior);
    return spectrum_mul(m.specular_reflectance, fresnel_conductor(cos_i, eta, k));
}

inline CoatedMetal coated_metal_of(CoatedConductor m, real eta)
{
    CoatedMetal c;
    c.eta = eta;
    c.coat = microfacets_of(m.distribution, m.coat_alpha, m.coat_alpha);
    real spread = 2.5f * sqr((1.0f - 1.0f / c.eta) * m.coat_alpha);
    real u = sqrt_r(sqr(m.alpha_u) + spread), v = sqrt_r(sqr(m.alpha_v) + spread);
    c.metal = microfacets_of(m.distribution, u, v);
    c.even = c.metal;
    c.even.alpha_u = sqrt_r(u * v);
    c.bounce = coat_bounced(c.even);
    c.between = 0.04f / (0.04f + u * v);
    c.leaves = 1.0f / (1.0f + 40.0f * sqr(c.even.alpha_u) / (c.even.alpha_u + 0.01f));
    Spectrum f = coated_conductor_fresnel(m, (real)(0.8f));
    real inside = coat_inside_reflectance(c.coat, c.eta);
#define C(x_)                                                \
    c.again.x_ = (1.0f - c.between) * f.x_ * f.x_ * c.bounce \
               / (1.0f - min_r(inside * f.x_ * c.bounce, (real)(0.999f)));
    SPECTRUM_EACH(C)
#undef C
    return c;
}
/* Of light that comes at a cosine, what the coat throws back once a metal that reflects all has sent it up. */
inline real coated_metal_thrown(CoatedMetal c, real cos_i) { return coat_thrown_back(c.even, cos_i, c.eta); }

/* w within the coat. */
inline vec3 coated_metal_refracted(CoatedMetal c, vec3 w)
{
    real inv = 1.0f / c.eta, x = w.x * inv, y = w.y * inv;
    return v3(x, y, sqrt_r(1.0f - x * x - y * y));
}

/* Probabilities of the coat's reflection and of the metal's lobe; the rest is diffuse. */
inline vec2 coated_conductor_lobes(CoatedConductor m, CoatedMetal c, vec3 wo, real t)
{
    real thrown = coated_metal_thrown(c, fabs(wo.z)), kept = 1.0f - thrown / max_r(c.bounce, (real)(1e-20f));
    real metal = t * kept * spectrum_mean(coated_conductor_fresnel(m, (real)(1.0f)));
    real diffuse = t * thrown * spectrum_mean(c.again), total = max_r(1.0f - t + metal + diffuse, (real)(1e-20f));
    return (vec2){(1.0f - t) / total, metal / total};
}

/* Density of wi for the metal's lobe. */
inline real coated_conductor_lobe(CoatedMetal c, vec3 inner_o, vec3 inner_i, vec3 h, real cos_i)
{
    real inner = microfacet_visible_pdf(c.metal, inner_o, h) / max_r(4.0f * dot3(inner_o, h), (real)(1e-20f));
    mask reached = inner_i.z > 1e-4f;
    return sel(reached, inner * cos_i / (sqr(c.eta) * max_r(inner_i.z, (real)(1e-4f))), (real)(0.0f));
}

/* eval at the wavelengths whose index c has, given T(wo). */
inline Spectrum coated_conductor_at(CoatedConductor m, CoatedMetal c, vec3 wo, vec3 wi, real t_wo)
{
    vec3 h = normalize3(add3(wo, wi));
    real g = microfacet_g1(c.coat, wo, h) * microfacet_g1(c.coat, wi, h);
    real coat = microfacet_d(c.coat, h) * g / max_r(4.0f * wo.z, (real)(1e-20f));
    real f = fresnel_dielectric(clamp_r(dot3(wo, h), (real)(0.0f), (real)(1.0f)), c.eta).f;
    real t = t_wo * coat_transmittance(c.coat, fabs(wi.z), c.eta);

    vec3 inner_o = coated_metal_refracted(c, wo), inner_i = coated_metal_refracted(c, wi);
    vec3 inner_h = normalize3(add3(inner_o, inner_i));
    real cos_h = clamp_r(dot3(inner_o, inner_h), (real)(0.0f), (real)(1.0f));
    real lobe = coated_conductor_lobe(c, inner_o, inner_i, inner_h, wi.z) * microfacet_g1(c.metal, inner_i, inner_h);
    Spectrum metal = coated_conductor_fresnel(m, cos_h), r;
    real thrown = sqrt_r(coated_metal_thrown(c, fabs(wo.z)) * coated_metal_thrown(c, fabs(wi.z)));
    real diffuse = thrown * wi.z * INV_PI / sqr(c.eta);
#define C(x_)                                                                                          \
    real CAT(echo_, x_) = c.between * thrown * metal.x_ * c.leaves                                     \
                        / max_r(1.0f - metal.x_ * (1.0f - c.leaves * (1.0f - thrown)), (real)(1e-3f)); \
    r.x_ = coat * f + t * (lobe * metal.x_ * (1.0f + CAT(echo_, x_)) + diffuse * c.again.x_);
    SPECTRUM_EACH(C)
#undef C
    return spectrum_sel((wo.z > 0.0f) & (wi.z > 0.0f), r, spectrum_of(0.0f));
}
/* eval; c and T(wo) are of the mean index. Where the coat disperses, each wavelength has a pass of the
 * loop, so that the value at a wavelength does not depend on the others. */
inline Spectrum coated_conductor_value(CoatedConductor m, CoatedMetal c, vec3 wo, vec3 wi, real t_wo)
{
    Spectrum eta = relative_index(m.coat_ior, m.ext_ior), r = spectrum_of(0.0f);
    int passes = any(spectrum_varies(eta)) ? SPECTRUM_SIZE : 1;
    for (int i = 0; i < passes; ++i) {
        int at = 0;
        if (passes > 1) {
#define C(x_) c.eta = i == at++ ? eta.x_ : c.eta;
            SPECTRUM_EACH(C)
#undef C
            c = coated_metal_of(m, c.eta);
            t_wo = coat_transmittance(c.coat, fabs(wo.z), c.eta);
        }
        Spectrum f = coated_conductor_at(m, c, wo, wi, t_wo);
        at = 0;
#define C(x_) r.x_ = i == 0 || i == at ? f.x_ : r.x_; ++at;
        SPECTRUM_EACH(C)
#undef C
    }
    return r;
}

/* pdf, likewise. */
inline real coated_conductor_density(CoatedConductor m, CoatedMetal c, vec3 wo, vec3 wi, real t_wo)
{
    vec3 h = normalize3(add3(wo, wi));
    vec3 inner_o = coated_metal_refracted(c, wo), inner_i = coated_metal_refracted(c, wi);
    vec2 p = coated_conductor_lobes(m, c, wo, t_wo);
    real coat = microfacet_visible_pdf(c.coat, wo, h) / max_r(4.0f * dot3(wo, h), (real)(1e-20f));
    real metal = coated_conductor_lobe(c, inner_o, inner_i, normalize3(add3(inner_o, inner_i)), wi.z);
    real pdf = p.x * coat + p.y * metal + max_r(1.0f - p.x - p.y, (real)(0.0f)) * cosine_hemisphere_pdf(wi.z);
    return sel((wo.z > 0.0f) & (wi.z > 0.0f), pdf, (real)(0.0f));
}

Spectrum coated_conductor_eval(CoatedConductor m, vec3 wo, vec3 wi)
{
    CoatedMetal c = coated_metal_of(m, spectrum_mean(relative_index(m.coat_ior, m.ext_ior)));
    return coated_conductor_value(m, c, wo, wi, coat_transmittance(c.coat, fabs(wo.z), c.eta));
}

real coated_conductor_pdf(CoatedConductor m, vec3 wo, vec3 wi)
{
    CoatedMetal c = coated_metal_of(m, spectrum_mean(relative_index(m.coat_ior, m.ext_ior)));
    return coated_conductor_density(m, c, wo, wi, coat_transmittance(c.coat, fabs(wo.z), c.eta));
}

BsdfSample coated_conductor_sample(CoatedConductor m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    CoatedMetal c = coated_metal_of(m, spectrum_mean(relative_index(m.coat_ior, m.ext_ior)));
    real t = coat_transmittance(c.coat, fabs(wo.z), c.eta);
    vec2 uv = {u.x, u.y}, p = coated_conductor_lobes(m, c, wo, t);
    mask coat = u.z < p.x, metal = !coat & (u.z < p.x + p.y), kept = wo.z > 0.0f;
    vec3 from = sel3(coat, wo, coated_metal_refracted(c, wo));
    Microfacets d = c.metal;
    d.alpha_u = sel(coat, c.coat.alpha_u, d.alpha_u);
    d.alpha_v = sel(coat, c.coat.alpha_v, d.alpha_v);
    s.wi = reflect_at(from, microfacet_visible(d, from, uv));
    real x = s.wi.x * c.eta, y = s.wi.y * c.eta, z2 = 1.0f - x * x - y * y;
    kept = kept & (!metal | ((s.wi.z > 0.0f) & (z2 > 0.0f)));
    s.wi = sel3(metal, normalize3(v3(x, y, sqrt_r(z2))), s.wi);
    s.wi = sel3(coat | metal, s.wi, cosine_hemisphere(uv));
    s.pdf = sel(kept, coated_conductor_density(m, c, wo, s.wi, t), (real)(0.0f));
    Spectrum f = coated_conductor_value(m, c, wo, s.wi, t);
    s.weight = spectrum_scale(f, sel(s.pdf > 0.0f, 1.0f / s.pdf, (real)(0.0f)));
    return s;
}

Spectrum coated_conductor_albedo(CoatedConductor m) { return coated_conductor_fresnel(m, (real)(1.0f)); }
