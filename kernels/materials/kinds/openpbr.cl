/* OpenPBR Surface 1.1: from the outside in fuzz, a coat, and facets of a metal or of a dielectric, under which light is
 * scattered back, goes into a body that scatters it, or is let through. A layer dims what lies under it by its
 * directional albedo. f [1/sr]. Front side; both sides where light goes through; thin: both sides are alike, light is
 * not refracted. The index of the base is relative to the coat's if there is a coat, and nearer to 1 where
 * `specular_weight` is below 1. As in materials/kinds/gltf_surface.cl no branch is around work that lobes share. */
#include "materials/openpbr_layers.cl"

inline real openpbr_side(Openpbr m, vec3 wo)
{
    return sel((m.thin_walled != 0) & (wo.z < 0.0f), (real)(-1.0f), (real)(1.0f));
}

/* Equally rough facets, and those of a roughness that is stretched along x. */
inline real openpbr_alpha(real roughness) { return sqr(clamp_r(roughness, (real)(0.0316f), (real)(1.0f))); }
inline Microfacets openpbr_stretched(real roughness, real stretched)
{
    real across = 1.0f - stretched, along = openpbr_alpha(roughness) * sqrt(2.0f / (1.0f + across * across));
    return microfacets_of((integer)(0), along, max_r(across * along, (real)(1e-3f)));
}
inline Microfacets openpbr_even(Microfacets d)
{
    real alpha = min_r(sqrt(d.alpha_u * d.alpha_v), (real)(1.0f));
    return microfacets_of((integer)(0), alpha, alpha);
}

/* What all functions ask of the parameters. */
typedef struct {
    Microfacets facets, coat, even, even_coat; /* even: as the albedos have them */
    real roughness;                            /* of the even facets */
    Spectrum eta, f0, metal;                   /* index; reflectance at normal incidence, and the metal's */
    real index;                                /* mean index, of probabilities alone: the same for every hero */
    FilmBase film, base_film;                  /* a film over all, over the dielectric alone */
    real passed, walk;                         /* shares under the facets: let through; sent into a body */
    Spectrum scattered, through;               /* colours of diffuse light that comes back, that passes a thin sheet */
} OpenpbrParts;

/* The index over what is above, and with it the reflectance at normal incidence, both by the weight. */
inline real openpbr_over(Openpbr m, real ior)
{
    real below = ior / m.coat_ior, n = max_r(below, 1.0f / max_r(below, (real)(1e-3f)));
    n = ior + (n - ior) * m.coat_weight;
    real root = (n - 1.0f) / (n + 1.0f);
    root *= sqrt_r(min_r(m.specular_weight, 0.9999f / max_r(root * root, (real)(1e-9f))));
    n = max_r((1.0f + root) / (1.0f - root), (real)(0.01f));
    return sel(fabs(n - 1.0f) < 1e-3f, (real)(1.001f), n);
}
inline Spectrum openpbr_index(Openpbr m)
{
    Spectrum eta = relative_index(m.specular_ior, spectrum_of(1.0f));
#define C(c) eta.c = openpbr_over(m, eta.c);
    SPECTRUM_EACH(C)
#undef C
    return eta;
}

inline OpenpbrParts openpbr_parts(Openpbr m)
{
    OpenpbrParts p;
    real dielectric = 1.0f - m.base_metalness, opaque = dielectric * (1.0f - m.transmission_weight);
    real rough = m.specular_roughness, coat4 = sqr(sqr(m.coat_roughness)), rough4 = sqr(sqr(rough));
    rough += (sqrt(sqrt(min_r(rough4 + 2.0f * coat4, (real)(1.0f)))) - rough) * m.coat_weight;
    p.facets = openpbr_stretched(rough, m.specular_roughness_anisotropy);
    p.coat = openpbr_stretched(m.coat_roughness, m.coat_roughness_anisotropy);
    p.even = openpbr_even(p.facets);
    p.even_coat = openpbr_even(p.coat);
    p.roughness = sqrt(p.even.alpha_u);
    p.eta = openpbr_index(m);
    p.index = spectrum_mean(p.eta);
#define C(c) p.f0.c = sqr((p.eta.c - 1.0f) / (p.eta.c + 1.0f));
    SPECTRUM_EACH(C)
#undef C
    p.metal = spectrum_scale(m.base_color, m.base_weight);
    p.passed = dielectric * m.transmission_weight;
    mask thin = m.thin_walled != 0;
    real below = opaque * m.subsurface_weight;
    p.walk = sel(!thin & (m.subsurface_inside != 0), below, (real)(0.0f));
    real forward = sel(thin, 0.5f + 0.5f * m.subsurface_scatter_anisotropy, (real)(0.0f));
    p.through = spectrum_scale(m.subsurface_color, below * forward);
    p.scattered = spectrum_scale(p.metal, opaque * (1.0f - m.subsurface_weight));
    p.scattered = spectrum_madd(m.subsurface_color, (below - p.walk) * (1.0f - forward), p.scattered);
    if (USES_OPENPBR_THIN_FILM_WEIGHT) {
        Spectrum all = spectrum_scale(spectrum_mul(m.specular_color, p.f0), dielectric);
        all = spectrum_madd(p.metal, m.base_metalness * min_r(m.specular_weight, (real)(1.0f)), all);
        p.film = film_base(all, m.thin_film_ior);
        p.base_film = film_base(p.f0, m.thin_film_ior);
    }
    return p;
}

/* What a reflectance leaves of each color: a film's may be outside of [0, 1] in RGB mode. */
inline Spectrum openpbr_complement(Spectrum f)
{
#define C(c) f.c = 1.0f - clamp_r(f.c, (real)(0.0f), (real)(1.0f));
    SPECTRUM_EACH(C)
#undef C
    return f;
}

/* Where a film covers a share of it, its reflectance, else f. */
inline Spectrum openpbr_filmed(Openpbr m, Spectrum f, FilmBase base, real c)
{
    if (USES_OPENPBR_THIN_FILM_WEIGHT) {
        real thickness = 1000.0f * m.thin_film_thickness;
        Spectrum film = iridescence(max_r(c, (real)(0.0f)), base, m.thin_film_ior, thickness, m.lambdas);
        f = spectrum_madd(spectrum_sub(film, f), sel(c < 0.0f, (real)(0.0f), m.thin_film_weight), f);
    }
    return f;
}
/* The reflectance of a facet on the front, of the dielectric's f, at cosine c. */
inline Spectrum openpbr_mixed(Openpbr m, OpenpbrParts p, Spectrum f, real c)
{
    real metal = m.base_metalness * min_r(m.specular_weight, (real)(1.0f));
#define C(c_)                                                                              \
    f.c_ *= m.specular_color.c_ * (1.0f - m.base_metalness);                               \
    f.c_ += metal * max_r(metal_edge(p.metal.c_, m.specular_color.c_, c), (real)(0.0f));
    SPECTRUM_EACH(C)
#undef C
    return f;
}

/* What facets send to each other and then out, over what they lose to each other, of a mean reflectance. */
inline real openpbr_bounced(real mean, real whole)
{
    return mean * mean * whole / max_r(1.0f - mean * (1.0f - whole), (real)(1e-3f));
}
inline Spectrum openpbr_bounces(Openpbr m, OpenpbrParts p, real whole)
{
    real metal = m.base_metalness * min_r(m.specular_weight, (real)(1.0f));
    Spectrum v;
#define C(c)                                                                                      \
    {                                                                                             \
        real mean = sel(p.eta.c < 1.0f, (real)(1.0f), p.f0.c + (1.0f - p.f0.c) * (1.0f / 21.0f)); \
        real dielectric = openpbr_bounced(mean, whole) * (1.0f - m.base_metalness);               \
        real f = max_r(metal_edge_mean(p.metal.c, m.specular_color.c), (real)(0.0f));             \
        v.c = dielectric * m.specular_color.c + metal * openpbr_bounced(f, whole);                \
    }
    SPECTRUM_EACH(C)
#undef C
    return v;
}
inline real openpbr_lost(OpenpbrParts p, real c)
{
    FacetAlbedo e = facet_albedo(c, p.roughness);
    return max_r(1.0f - e.a - e.b, (real)(0.0f));
}
inline real openpbr_whole(OpenpbrParts p)
{
    FacetAlbedo e = facet_albedo_mean(p.roughness);
    return e.a + e.b;
}

/* What facets of this index leave to a base that scatters: (1 - E(o)) (1 - E(i)) / (1 - mean E), which loses nothing,
 * with the directional albedo E. Into a body: 1 - E of the outside; out of it, that over its mean. */
inline real openpbr_left(OpenpbrParts p, real c, real several, real index)
{
    return 1.0f - facet_reflectance(p.even, c, index) - several * openpbr_lost(p, c);
}
inline real openpbr_share(OpenpbrParts p, vec3 wo, vec3 wi, mask into, real index)
{
    real whole = openpbr_whole(p), f0 = sqr((index - 1.0f) / (index + 1.0f));
    real several = openpbr_bounced(f0 + (1.0f - f0) * (1.0f / 21.0f), whole);
    several = sel(index < 1.0f, (real)(0.0f), several);
    real o = openpbr_left(p, fabs(wo.z), several, index), i = openpbr_left(p, fabs(wi.z), several, index);
    real mean = max_r(1.0f - facet_reflectance_mean(p.even, index) - several * (1.0f - whole), (real)(1e-3f));
    return sel(into, sel(wo.z > 0.0f, o, i / mean), o * i / mean);
}
/* The same at each index, with a film the lesser of both directions. */
inline Spectrum openpbr_under(Openpbr m, OpenpbrParts p, vec3 wo, vec3 wi, mask into)
{
    real cos_o = fabs(wo.z), cos_i = fabs(wi.z);
    mask front = wo.z > 0.0f;
    Spectrum v = spectrum_of(openpbr_share(p, wo, wi, into, p.eta.x));
    if (any(spectrum_varies(p.eta))) {
#define C(c) v.c = openpbr_share(p, wo, wi, into, p.eta.c);
        SPECTRUM_EACH(C)
#undef C
    }
    if (USES_OPENPBR_THIN_FILM_WEIGHT) {
        Spectrum left;
        real thickness = 1000.0f * m.thin_film_thickness;
        real rough = sqr(p.even.alpha_u), flat = 1.0f - rough;
        real c_o = sqrt(rough + flat * cos_o * cos_o), c_i = sqrt(rough + flat * cos_i * cos_i); /* of facets seen */
        Spectrum f_o = iridescence(c_o, p.base_film, m.thin_film_ior, thickness, m.lambdas);
        Spectrum f_i = iridescence(c_i, p.base_film, m.thin_film_ior, thickness, m.lambdas);
        f_o = openpbr_complement(spectrum_scale(f_o, 1.0f - openpbr_lost(p, cos_o)));
        f_i = openpbr_complement(spectrum_scale(f_i, 1.0f - openpbr_lost(p, cos_i)));
#define C(c) left.c = sel(into, sel(front, f_o.c, f_i.c), min_r(f_o.c, f_i.c));
        SPECTRUM_EACH(C)
#undef C
        v = spectrum_madd(spectrum_sub(left, v), m.thin_film_weight, v);
    }
    return v;
}

/* The effect of a coat: its reflectance for light from wo and from wi, and the transmittance of its colour both ways,
 * also with darkening by internal reflection. */
typedef struct { real o, i; Spectrum absorbed, darkened; } OpenpbrCoat;
/* Passes through the coat, as many as it takes to be seen through at its index. */
inline real openpbr_passes(Openpbr m, real z)
{
    real c2 = 1.0f - (1.0f - z * z) / sqr(m.coat_ior);
    return 0.5f / sqrt(max_r(c2, (real)(1e-4f)));
}
inline OpenpbrCoat openpbr_coat(Openpbr m, OpenpbrParts p, vec3 wo, vec3 wi)
{
    OpenpbrCoat k;
    mask thin = m.thin_walled != 0, crossed = wo.z * wi.z < 0.0f;
    mask on_o = thin | (wo.z > 0.0f), on_i = thin | (wi.z > 0.0f);
    real e_o = facet_reflectance(p.even_coat, fabs(wo.z), m.coat_ior);
    real e_i = facet_reflectance(p.even_coat, fabs(wi.z), m.coat_ior);
    k.o = sel(on_o, m.coat_weight * e_o, (real)(0.0f));
    k.i = sel(on_i, m.coat_weight * e_i, (real)(0.0f));
    real passes = sel(on_o, openpbr_passes(m, wo.z), (real)(0.0f)) + sel(on_i, openpbr_passes(m, wi.z), (real)(0.0f));
    passes *= sel(thin & crossed, (real)(0.5f), (real)(1.0f));
    real diffuse = 1.0f - (1.0f - facet_reflectance_mean(p.even_coat, m.coat_ior)) / sqr(m.coat_ior);
    real smooth = 0.5f * (e_o + e_i), amount = sel(crossed, (real)(0.0f), m.coat_weight * m.coat_darkening);
#define C(c)                                                                                              \
    {                                                                                                     \
        real t = exp_r(passes * log_r(max_r(m.coat_color.c, (real)(1e-6f))));                             \
        k.absorbed.c = 1.0f + (t - 1.0f) * m.coat_weight;                                                 \
        real f0 = p.f0.c, dielectric = (1.0f - m.base_metalness) * f0 * m.specular_color.c;               \
        real rough = 1.0f + (m.specular_roughness - 1.0f) * (f0 + (1.0f - f0) * m.base_metalness);        \
        real back = smooth + (diffuse - smooth) * rough;                                                  \
        real base = (1.0f - f0) * (p.scattered.c + p.walk * m.subsurface_color.c) + dielectric;           \
        base += m.base_metalness * min_r(m.specular_weight, (real)(1.0f)) * p.metal.c;                    \
        real dark = (1.0f - back) / max_r(1.0f - min_r(base, (real)(1.0f)) * back, (real)(1e-3f));        \
        k.darkened.c = 1.0f + (dark - 1.0f) * amount;                                                     \
    }
    SPECTRUM_EACH(C)
#undef C
    return k;
}

/* Probabilities of the lobes by the strengths that wo sees; `facets`: of the facets under the coat. */
typedef struct { real coat, fuzz, scattered, through, facets; } OpenpbrLobes;
inline OpenpbrLobes openpbr_lobes(Openpbr m, OpenpbrParts p, vec3 wo)
{
    mask front = wo.z > 0.0f;
    real c = fabs(wo.z), nothing = 0.0f;
    OpenpbrLobes l = {nothing, nothing, nothing, nothing, nothing};
    if (USES_OPENPBR_FUZZ_WEIGHT)
        l.fuzz = sel(front, m.fuzz_weight * fuzz_albedo(fuzz_lobe(c, m.fuzz_roughness)), nothing);
    real rest = max_r(1.0f - l.fuzz, (real)(0.05f));
    l.fuzz *= spectrum_mean(m.fuzz_color);
    if (USES_OPENPBR_COAT_WEIGHT) {
        l.coat = sel(front, rest * m.coat_weight * facet_reflectance(p.even_coat, c, m.coat_ior), nothing);
        rest = max_r(rest - l.coat, (real)(0.05f));
    }
    real f = facet_reflectance(p.even, c, p.index), film = 0.25f * m.thin_film_weight;
    Spectrum mirrored = openpbr_mixed(m, p, spectrum_of(f), c);
    real left = max_r(1.0f - f, (real)(0.05f)), passed = left * p.passed * spectrum_mean(m.transmission_tint);
    l.facets = sel(front, rest * (spectrum_mean(mirrored) + film + passed),
                   sel(p.passed > 0.0f, p.passed, nothing));
    real lost = openpbr_lost(p, c) * spectrum_mean(openpbr_bounces(m, p, openpbr_whole(p)));
    l.scattered = sel(front, rest * (left * spectrum_mean(p.scattered) + lost), nothing);
    if (USES_OPENPBR_SUBSURFACE_WEIGHT) {
        real out = sel(p.walk > 0.0f, 1.0f - p.passed, nothing);
        l.through = sel(front, rest * left * (spectrum_mean(p.through) + p.walk), out);
    }
    real inv = 1.0f / max_r(l.coat + l.fuzz + l.facets + l.scattered + l.through, (real)(1e-20f));
    l.coat *= inv;
    l.fuzz *= inv;
    l.facets *= inv;
    l.scattered *= inv;
    l.through *= inv;
    return l;
}
/* The probability that a facet reflects, at the signed cosine o to it. */
inline real openpbr_reflects(Openpbr m, OpenpbrParts p, real o)
{
    real f = fresnel_dielectric(o, p.index).f, film = 0.25f * m.thin_film_weight;
    real front = spectrum_mean(openpbr_mixed(m, p, spectrum_of(f), fabs(o))) + film;
    real turned = sel(o > 0.0f, front, p.passed * f);
    real t = (1.0f - f) * p.passed * spectrum_mean(m.transmission_tint);
    return sel(p.passed > 0.0f, turned / max_r(turned + t, (real)(1e-9f)), (real)(1.0f));
}

/* f |cos| of the facets: reflection, and transmission at an index. */
inline Spectrum openpbr_facets(Openpbr m, OpenpbrParts p, vec3 wo, vec3 wi, real index)
{
    mask front = wo.z > 0.0f, crossed = wo.z * wi.z < 0.0f;
    RefractingFacet h = sheet_facet(m.thin_walled != 0, USES_OPENPBR_TRANSMISSION_WEIGHT, wo, wi, index);
    real v = microfacet_visible_pdf(p.facets, wo, h.h) * h.jacobian;
    v *= microfacet_g1(p.facets, sheet_seen(m.thin_walled != 0, wo, wi), h.h);
    v = sel(h.shading, v, (real)(0.0f));
    Fresnel boundary = fresnel_dielectric(h.o, index);
    real c = sel(front, fabs(h.o), fabs(boundary.cos_t));
    Spectrum f = spectrum_of(boundary.f), turned = openpbr_mixed(m, p, f, fabs(h.o));
    FilmBase film = p.film;
    if (USES_OPENPBR_TRANSMISSION_WEIGHT) {
        mask base = crossed | !front;
        turned = spectrum_sel(base, f, turned);
        film.reflectance = spectrum_sel(base, p.base_film.reflectance, film.reflectance);
        film.shift = spectrum_sel(base, p.base_film.shift, film.shift);
    }
    turned = openpbr_filmed(m, turned, film, sel(boundary.f < 1.0f, c, (real)(-1.0f)));
    real share = sel(front, (real)(1.0f), p.passed);
    if (USES_OPENPBR_TRANSMISSION_WEIGHT) {
        real scale = sel(m.thin_walled != 0, (real)(1.0f), sel(front, 1.0f / sqr(index), sqr(index)));
        Spectrum passed = openpbr_complement(turned);
        turned = spectrum_sel(crossed, spectrum_mul(passed, m.transmission_tint), turned);
        share = sel(crossed, scale * p.passed, share);
    } else
        share = sel(crossed, (real)(0.0f), share);
    return spectrum_scale(turned, v * share);
}

/* The transmittance of a layer with reflectances o and i for wo and wi: for facets the lesser transmittance, for
 * diffuse light the product of both over the mean, which conserves energy if both directions are above. */
typedef struct { real facets, diffuse; } OpenpbrDimmed;
inline OpenpbrDimmed openpbr_dimmed(OpenpbrDimmed d, real o, real i, real mean, mask both)
{
    d.facets *= 1.0f - max_r(o, i);
    d.diffuse *= (1.0f - o) * (1.0f - i) * sel(both, 1.0f / max_r(1.0f - mean, (real)(1e-3f)), (real)(1.0f));
    return d;
}

/* f |cos| of the base, dimmed by the layers above. */
inline Spectrum openpbr_base(Openpbr m, OpenpbrParts p, vec3 wo, vec3 wi, OpenpbrDimmed dimmed)
{
    mask reflected = wo.z * wi.z > 0.0f, crossed = wo.z * wi.z < 0.0f, front = wo.z > 0.0f;
    Spectrum v = openpbr_facets(m, p, wo, wi, p.eta.x);
    if (any(spectrum_varies(p.eta))) {
#define C(c) v.c = openpbr_facets(m, p, wo, wi, p.eta.c).c;
        SPECTRUM_EACH(C)
#undef C
    }
    v = spectrum_scale(v, dimmed.facets);
    vec3 up_o = v3(wo.x, wo.y, fabs(wo.z)), up_i = v3(wi.x, wi.y, fabs(wi.z));
    mask into = crossed & (m.thin_walled == 0);
    Spectrum under = openpbr_under(m, p, wo, wi, into);
    Spectrum grooves = eon(m.base_color, m.base_diffuse_roughness, up_o, up_i);
    Spectrum back = spectrum_mul(under, spectrum_mul(p.scattered, grooves));
    real whole = openpbr_whole(p), lost = openpbr_lost(p, up_o.z) * openpbr_lost(p, up_i.z);
    lost /= max_r(1.0f - whole, (real)(1e-3f));
    back = spectrum_madd(openpbr_bounces(m, p, whole), lost, back);
    real cosine = up_i.z * INV_PI * dimmed.diffuse;
    v = spectrum_madd(back, sel(front & reflected, cosine, (real)(0.0f)), v);
    if (USES_OPENPBR_SUBSURFACE_WEIGHT) {
        real walk = sel(front, p.walk, sel(p.walk > 0.0f, 1.0f - p.passed, (real)(0.0f)));
        Spectrum passing = spectrum_add(p.through, spectrum_of(walk));
        v = spectrum_madd(spectrum_mul(under, passing), sel(crossed, cosine, (real)(0.0f)), v);
    }
    return v;
}

/* f |cos|. */
inline Spectrum openpbr_value(Openpbr m, OpenpbrParts p, vec3 wo, vec3 wi)
{
    mask front = wo.z > 0.0f, reflected = wo.z * wi.z > 0.0f, crossed = wo.z * wi.z < 0.0f;
    mask seen = front | (p.passed > 0.0f) | (p.walk > 0.0f), outside = front & reflected;
    mask thin = m.thin_walled != 0, both = thin | outside;
    OpenpbrDimmed fuzzy = {(real)(1.0f), (real)(1.0f)}, dimmed = fuzzy;
    Spectrum v = spectrum_of(0.0f), left = spectrum_of(1.0f);
    if (USES_OPENPBR_FUZZ_WEIGHT) {
        FuzzLobe o = fuzz_lobe(fabs(wo.z), m.fuzz_roughness), i = fuzz_lobe(fabs(wi.z), m.fuzz_roughness);
        real e_o = sel(thin | front, m.fuzz_weight * fuzz_albedo(o), (real)(0.0f));
        real e_i = sel(thin | (wi.z > 0.0f), m.fuzz_weight * fuzz_albedo(i), (real)(0.0f));
        real mean = max_r(fuzz_albedo_mean(o) - 0.01f, (real)(0.0f)); /* facets let less through */
        fuzzy = openpbr_dimmed(dimmed, e_o, e_i, m.fuzz_weight * mean, both);
        v = spectrum_scale(m.fuzz_color, sel(outside, m.fuzz_weight * fuzz(o, i, wo, wi), (real)(0.0f)));
        dimmed = fuzzy;
    }
    if (USES_OPENPBR_COAT_WEIGHT) {
        OpenpbrCoat k = openpbr_coat(m, p, wo, wi);
        real mean = m.coat_weight * facet_reflectance_mean(p.even_coat, m.coat_ior);
        dimmed = openpbr_dimmed(fuzzy, k.o, k.i, mean, both);
        left = spectrum_mul(k.absorbed, k.darkened);
        RefractingFacet h = refracting_facet(wo, wi, (real)(1.0f));
        real coat = microfacet_visible_pdf(p.coat, wo, h.h) * h.jacobian * microfacet_g1(p.coat, wi, h.h);
        coat *= m.coat_weight * fresnel_dielectric(h.o, m.coat_ior).f * fuzzy.facets;
        v = spectrum_add(v, spectrum_of(sel(h.shading & outside, coat, (real)(0.0f))));
    }
    v = spectrum_add(v, spectrum_mul(openpbr_base(m, p, wo, wi, dimmed), left));
    return spectrum_sel(seen & (reflected | crossed), v, spectrum_of(0.0f));
}

/* pdf for a hero with this index. */
inline real openpbr_density(Openpbr m, OpenpbrParts p, OpenpbrLobes l, vec3 wo, vec3 wi, real index)
{
    mask reflected = wo.z * wi.z > 0.0f, crossed = wo.z * wi.z < 0.0f, front = wo.z > 0.0f;
    RefractingFacet h = sheet_facet(m.thin_walled != 0, USES_OPENPBR_TRANSMISSION_WEIGHT, wo, wi, index);
    real turned = openpbr_reflects(m, p, h.o);
    real facets = microfacet_visible_pdf(p.facets, wo, h.h) * sel(crossed, 1.0f - turned, turned) * l.facets;
    if (USES_OPENPBR_COAT_WEIGHT)
        facets += sel(crossed, (real)(0.0f), microfacet_visible_pdf(p.coat, wo, h.h) * l.coat);
    real back = sel(front, l.scattered * cosine_hemisphere_pdf(wi.z), (real)(0.0f));
    if (USES_OPENPBR_FUZZ_WEIGHT)
        back += sel(front, l.fuzz * fuzz_pdf(fuzz_lobe(fabs(wo.z), m.fuzz_roughness), wo, wi), (real)(0.0f));
    real pdf = sel(crossed, l.through * cosine_hemisphere_pdf(fabs(wi.z)), back);
    pdf += sel(h.shading, facets * h.jacobian, (real)(0.0f));
    return sel(reflected | crossed, pdf, (real)(0.0f));
}

/* A direction along and across the tangent, to which u is turned; sign -1: back. */
inline vec3 openpbr_turn(Openpbr m, vec3 w, real sign)
{
    return USES_OPENPBR_ANISOTROPY_ROTATION ? turned_about_z(w, m.anisotropy_rotation, sign) : w;
}
/* Likewise, on the front of a thin surface. */
inline vec3 openpbr_up(Openpbr m, vec3 wo, vec3 w)
{
    w = openpbr_turn(m, w, (real)(1.0f));
    w.z *= openpbr_side(m, wo);
    return w;
}

Spectrum openpbr_eval(Openpbr m, vec3 wo, vec3 wi)
{
    return openpbr_value(m, openpbr_parts(m), openpbr_up(m, wo, wo), openpbr_up(m, wo, wi));
}

real openpbr_pdf(Openpbr m, vec3 wo, vec3 wi)
{
    OpenpbrParts p = openpbr_parts(m);
    vec3 o = openpbr_up(m, wo, wo);
    return openpbr_density(m, p, openpbr_lobes(m, p, o), o, openpbr_up(m, wo, wi), p.eta.x);
}

Spectrum openpbr_pdfs(Openpbr m, vec3 wo, vec3 wi)
{
    OpenpbrParts p = openpbr_parts(m);
    vec3 o = openpbr_up(m, wo, wo), i = openpbr_up(m, wo, wi);
    OpenpbrLobes l = openpbr_lobes(m, p, o);
    Spectrum v = spectrum_of(openpbr_density(m, p, l, o, i, p.eta.x));
    if (any(spectrum_varies(p.eta))) {
#define C(c) v.c = openpbr_density(m, p, l, o, i, p.eta.c);
        SPECTRUM_EACH(C)
#undef C
    }
    return v;
}

BsdfSample openpbr_sample(Openpbr m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    OpenpbrParts p = openpbr_parts(m);
    vec3 o = openpbr_up(m, wo, wo);
    OpenpbrLobes l = openpbr_lobes(m, p, o);
    real before = l.coat + l.fuzz + l.scattered + l.through;
    mask coat = u.z < l.coat, facets = u.z >= before, up = o.z > 0.0f;
    mask fuzz = !coat & (u.z < l.coat + l.fuzz), through = !facets & (u.z >= l.coat + l.fuzz + l.scattered);
    vec2 uv = {u.x, u.y};
    Microfacets d = p.facets;
    d.alpha_u = sel(coat, p.coat.alpha_u, d.alpha_u);
    d.alpha_v = sel(coat, p.coat.alpha_v, d.alpha_v);
    vec3 h = microfacet_visible(d, scale3(o, sel(up, (real)(1.0f), (real)(-1.0f))), uv);
    real cosine = dot3(o, h), v = (u.z - before) / max_r(1.0f - before, (real)(1e-6f));
    mask passes = facets & (v >= openpbr_reflects(m, p, cosine));
    vec3 w = reflect_at(o, h);
    Fresnel f = fresnel_dielectric(cosine, p.eta.x);
    if (USES_OPENPBR_TRANSMISSION_WEIGHT) {
        vec3 refracted = normalize3(sub3(scale3(h, cosine / f.eta + f.cos_t), scale3(o, 1.0f / f.eta)));
        w = sel3(passes, sel3(m.thin_walled != 0, v3(w.x, w.y, -w.z), refracted), w);
    }
    vec3 even = cosine_hemisphere(uv);
    even.z *= sel(through & up, (real)(-1.0f), (real)(1.0f));
    w = sel3(coat | facets, w, even);
    if (USES_OPENPBR_FUZZ_WEIGHT)
        w = sel3(fuzz, fuzz_sample(fuzz_lobe(fabs(o.z), m.fuzz_roughness), o, uv), w);
    mask crossing = passes | through;
    mask kept = sel_i(crossing, o.z * w.z < 0.0f, o.z * w.z > 0.0f) != 0;
    s.pdf = sel(kept, openpbr_density(m, p, l, o, w, p.eta.x), (real)(0.0f));
    s.weight = spectrum_scale(openpbr_value(m, p, o, w), sel(s.pdf > 0.0f, 1.0f / s.pdf, (real)(0.0f)));
    s.wi = openpbr_turn(m, w, (real)(-1.0f));
    s.wi.z *= openpbr_side(m, wo);
    s.eta = sel(passes & (m.thin_walled == 0), f.eta, (real)(1.0f));
    s.lobe = sel_i(crossing, (integer)(LOBE_TRANSMIT), (integer)(LOBE_REFLECT));
    return s;
}

Spectrum openpbr_albedo(Openpbr m) { return m.base_color; }

real openpbr_across(Openpbr m) { return sel(m.thin_walled != 0, (real)(1.0f), openpbr_index(m).x); }
