/* glTF 2.0's material with its extensions (glTF 2.0 appendix B; KHR_materials_anisotropy, _clearcoat,
 * _diffuse_transmission, _ior, _iridescence, _sheen, _specular, _transmission, _volume): from the outside
 * in a clear coat, sheen, and microfacets over a base that scatters light back, scatters it through or
 * lets it through, all mixed with a metal. A layer dims what lies under it by its directional albedo.
 * f [1/sr]. Front side; both sides where light goes through; thin: both sides are alike, light is not refracted.
 * A lobe that some material of the scene has is computed for all, without branches: so compilers find what eval, pdf
 * and sample have in common, which is most of it. */
#include "materials/gltf_layers.cl"

/* Both directions as the lobes see them: along and across the anisotropy; the back of a thin surface is turned up. */
typedef struct { vec3 wo, wi; } GltfPair;
inline vec3 gltf_turn(GltfSurface m, vec3 w, real sign)
{
    return USES_GLTF_SURFACE_ANISOTROPY ? turned_about_z(w, m.anisotropy_rotation, sign) : w;
}
inline real gltf_side(GltfSurface m, vec3 wo)
{
    return sel((m.thin != 0) & (wo.z < 0.0f), (real)(-1.0f), (real)(1.0f));
}
inline GltfPair gltf_pair(GltfSurface m, vec3 wo, vec3 wi)
{
    real side = gltf_side(m, wo);
    GltfPair p = {gltf_turn(m, wo, (real)(1.0f)), gltf_turn(m, wi, (real)(1.0f))};
    p.wo.z *= side;
    p.wi.z *= side;
    return p;
}

/* The coat's normal, if it differs from the shading normal, and a turned direction in its frame. */
inline vec3 gltf_coat_normal(GltfSurface m)
{
    real scale = 2.0f * m.clearcoat_normal_scale;
    vec3 n = v3((m.clearcoat_normal_x - 0.5f) * scale, (m.clearcoat_normal_y - 0.5f) * scale,
                max_r(2.0f * m.clearcoat_normal_z - 1.0f, (real)(0.02f)));
    n = gltf_turn(m, normalize3(n), (real)(1.0f));
    return sel3(m.clearcoat_apart > 0.0f, n, v3(0.0f, 0.0f, 1.0f));
}
inline vec3 gltf_coated(GltfSurface m, vec3 w)
{
    return USES_GLTF_SURFACE_CLEARCOAT_APART ? to_frame(frame_of(gltf_coat_normal(m)), w) : w;
}
/* What is left of the coat's light where its normal leans away from a direction by more than the surface's does: so
 * it is reciprocal, and reflects no more than comes. */
inline real gltf_coat_lean(real coated, real z)
{
    return clamp_r(coated / max_r(fabs(z), (real)(1e-6f)), (real)(0.0f), (real)(1.0f));
}

/* What all functions ask of the parameters. */
typedef struct {
    Microfacets facets, coat;
    real roughness;            /* that of the albedo of stretched facets, too */
    Spectrum eta, f0, base_f0; /* index; reflectance at normal incidence of all, of the dielectric alone */
    real f90;                  /* of all at grazing angles; the dielectric's is m.specular */
    FilmBase film, base_film;  /* a film over all, over the dielectric alone */
    real passed;               /* transmitted share under the facets */
    real scattered, through;   /* shares of diffuse reflection and diffuse transmission */
} GltfParts;

inline GltfParts gltf_parts(GltfSurface m)
{
    GltfParts p;
    real r = clamp_r(m.roughness, (real)(0.0316f), (real)(1.0f)), alpha = r * r, dielectric = 1.0f - m.metallic;
    real along = alpha + (1.0f - alpha) * sqr(m.anisotropy);
    real coat = sqr(clamp_r(m.clearcoat_roughness, (real)(0.0316f), (real)(1.0f)));
    p.facets = microfacets_of((integer)(0), along, alpha);
    p.coat = microfacets_of((integer)(0), coat, coat);
    p.roughness = USES_GLTF_SURFACE_ANISOTROPY ? sqrt(sqrt(along * alpha)) : r;
    p.eta = relative_index(m.ior, spectrum_of(1.0f));
#define C(c)                                                                                                       \
    p.base_f0.c = min_r(sqr((p.eta.c - 1.0f) / (p.eta.c + 1.0f)) * m.specular_color.c, (real)(1.0f)) * m.specular; \
    p.f0.c = p.base_f0.c + (m.base_color.c - p.base_f0.c) * m.metallic;                                            \
    p.eta.c = max_r(p.eta.c, (real)(0.01f));                                                                       \
    p.eta.c = sel(fabs(p.eta.c - 1.0f) < 1e-3f, (real)(1.001f), p.eta.c);
    SPECTRUM_EACH(C)
#undef C
    p.base_f0 = layer_cover(p.base_f0);
    p.f90 = m.specular + (1.0f - m.specular) * m.metallic;
    p.film = film_base(p.f0, m.iridescence_ior);
    p.base_film = film_base(p.base_f0, m.iridescence_ior);
    p.passed = dielectric * m.transmission;
    real scatters = dielectric * (1.0f - m.transmission);
    p.through = scatters * m.diffuse_transmission;
    p.scattered = scatters - p.through;
    return p;
}

/* The cosine on the thinner side of a facet that is met at signed cosine c, where light is refracted; -1 where
 * all of it is reflected. */
inline real gltf_cosine(GltfSurface m, real c, real index)
{
    real x = fabs(c);
    if (USES_GLTF_SURFACE_TRANSMISSION) {
        mask refracts = (m.thin == 0) & (m.transmission > 0.0f);
        real eta = sel(c < 0.0f, 1.0f / index, index), cos2 = 1.0f - (1.0f - x * x) / (eta * eta);
        x = sel(refracts & (eta < 1.0f), sel(cos2 > 0.0f, sqrt_r(cos2), (real)(-1.0f)), x);
    }
    return x;
}
/* Schlick's reflectance; f0: at normal incidence, f90: at grazing angles. */
inline real gltf_schlick(real f0, real f90, real c)
{
    real x = 1.0f - c, weight = x * x * x * x * x;
    return sel(weight > 1.0f, (real)(1.0f), f0 + (f90 - f0) * weight);
}
/* With a film on it. */
inline Spectrum gltf_reflectance(GltfSurface m, Spectrum f0, real f90, FilmBase base, real c)
{
    Spectrum f;
#define C(c_) f.c_ = gltf_schlick(f0.c_, f90, c);
    SPECTRUM_EACH(C)
#undef C
    if (USES_GLTF_SURFACE_IRIDESCENCE) {
        real thickness = m.iridescence_thickness;
        Spectrum film = iridescence(max_r(c, (real)(0.0f)), base, m.iridescence_ior, thickness, m.lambdas);
        f = spectrum_madd(spectrum_sub(film, f), sel(c < 0.0f, (real)(0.0f), m.iridescence), f);
    }
    return f;
}

/* What facets send to each other and then out, over what they lose to each other: the mean of Schlick's reflectance,
 * as often as light meets a facet (Kulla and Conty 2017). */
inline Spectrum gltf_bounced(GltfSurface m, GltfParts p, Spectrum f0, real f90)
{
    FacetAlbedo mean = facet_albedo_mean(p.roughness);
    real e = mean.a + mean.b;
    Spectrum v;
#define C(c)                                                                                            \
    {                                                                                                   \
        real f = f0.c + (f90 - f0.c) * (1.0f / 21.0f);                                                  \
        v.c = m.multiple_scattering * f * f * e / max_r(1.0f - f * (1.0f - e), (real)(1e-3f));          \
    }
    SPECTRUM_EACH(C)
#undef C
    return v;
}
inline real gltf_lost(FacetAlbedo e) { return max_r(1.0f - e.a - e.b, (real)(0.0f)); }

/* The share of light under the dielectric's facets: 1 - E, with the directional albedo E; and the same with a
 * film. */
inline Spectrum gltf_left(GltfSurface m, GltfParts p, FacetAlbedo e)
{
    Spectrum v;
#define C(c) v.c = 1.0f - p.base_f0.c * e.a - m.specular * e.b;
    SPECTRUM_EACH(C)
#undef C
    if (USES_GLTF_SURFACE_MULTIPLE_SCATTERING)
        v = spectrum_madd(gltf_bounced(m, p, p.base_f0, m.specular), -gltf_lost(e), v);
    return v;
}
inline Spectrum gltf_left_by_film(GltfSurface m, GltfParts p, FacetAlbedo e, real c)
{
    Spectrum film = iridescence(c, p.film, m.iridescence_ior, m.iridescence_thickness, m.lambdas);
    return spectrum_sub(spectrum_of(1.0f), spectrum_scale(layer_cover(film), e.a + e.b));
}
/* What they leave to a base that scatters: (1 - E(o)) (1 - E(i)) / (1 - mean E), which loses nothing; with a film
 * the lesser of both, which loses a little. What has gone through a body: 1 - E on its outside. */
inline Spectrum gltf_under(GltfSurface m, GltfParts p, real cos_o, real cos_i, mask front, mask refracted)
{
    FacetAlbedo e_o = facet_albedo(cos_o, p.roughness), e_i = facet_albedo(cos_i, p.roughness);
    Spectrum v, o = gltf_left(m, p, e_o), i = gltf_left(m, p, e_i);
    Spectrum mean = gltf_left(m, p, facet_albedo_mean(p.roughness));
#define C(c) v.c = sel(refracted, sel(front, o.c, i.c), o.c * i.c / max_r(mean.c, (real)(1e-3f)));
    SPECTRUM_EACH(C)
#undef C
    if (USES_GLTF_SURFACE_IRIDESCENCE) {
        o = gltf_left_by_film(m, p, e_o, cos_o);
        i = gltf_left_by_film(m, p, e_i, cos_i);
#define C(c) v.c += (sel(refracted, sel(front, o.c, i.c), min_r(o.c, i.c)) - v.c) * m.iridescence;
        SPECTRUM_EACH(C)
#undef C
    }
    return v;
}

/* Albedo of the clear coat at a direction on the outside; of the sheen, if it were white. */
inline real gltf_coat_albedo(GltfSurface m, real z)
{
    FacetAlbedo e = facet_albedo(max_r(z, (real)(0.0f)), clamp_r(m.clearcoat_roughness, (real)(0.0316f), (real)(1.0f)));
    return sel(z > 0.0f, m.clearcoat * (0.04f * e.a + e.b), (real)(0.0f));
}
inline real gltf_sheen_albedo(GltfSurface m, real z)
{
    return sel(z > 0.0f, charlie_albedo(max_r(z, (real)(0.0f)), m.sheen_roughness), (real)(0.0f));
}

/* Probabilities of the lobes by the strengths that wo sees; `facets`: of the facets under the coat. */
typedef struct { real coat, sheen, scattered, through, facets; } GltfLobes;
inline GltfLobes gltf_lobes(GltfSurface m, GltfParts p, vec3 wo)
{
    mask front = wo.z > 0.0f;
    real colour = spectrum_mean(m.base_color), c = fabs(wo.z);
    FacetAlbedo e = facet_albedo(c, p.roughness);
    GltfLobes l = {(real)(0.0f), (real)(0.0f), (real)(0.0f), (real)(0.0f), (real)(0.0f)};
    if (USES_GLTF_SURFACE_CLEARCOAT) l.coat = gltf_coat_albedo(m, gltf_coated(m, wo).z);
    if (USES_GLTF_SURFACE_SHEEN_COLOR)
        l.sheen = (1.0f - l.coat) * gltf_sheen_albedo(m, wo.z) * spectrum_mean(m.sheen_color);
    real rest = max_r(1.0f - l.coat - l.sheen, (real)(0.05f)), film = 0.25f * m.iridescence;
    real left = max_r(1.0f - spectrum_mean(p.base_f0) * e.a - m.specular * e.b, (real)(0.05f));
    real mirrored = spectrum_mean(p.f0) * e.a + p.f90 * e.b + film;
    l.facets = sel(front, rest * (mirrored + left * p.passed * colour),
                   sel(p.passed > 0.0f, (real)(1.0f), (real)(0.0f)));
    l.scattered = sel(front, rest * left * p.scattered * colour, (real)(0.0f));
    if (USES_GLTF_SURFACE_MULTIPLE_SCATTERING)
        l.scattered += sel(front, rest * gltf_lost(e) * spectrum_mean(gltf_bounced(m, p, p.f0, p.f90)), (real)(0.0f));
    l.through = rest * left * p.through * spectrum_mean(m.diffuse_transmission_color);
    real total = l.coat + l.sheen + l.facets + l.scattered + l.through;
    real inv = sel(total > 0.0f, 1.0f / max_r(total, (real)(1e-20f)), (real)(0.0f));
    l.coat *= inv;
    l.sheen *= inv;
    l.facets *= inv;
    l.scattered *= inv;
    l.through *= inv;
    return l;
}
/* The probability that a facet reflects, at the cosine on its thinner side. */
inline real gltf_reflects(GltfSurface m, GltfParts p, real c)
{
    real f = gltf_schlick(spectrum_mean(p.f0), p.f90, c) + 0.25f * m.iridescence;
    real t = (1.0f - gltf_schlick(spectrum_mean(p.base_f0), m.specular, c)) * p.passed * spectrum_mean(m.base_color);
    return sel(p.passed > 0.0f, f / max_r(f + t, (real)(1e-6f)), (real)(1.0f));
}

/* f |cos| of the facets: reflection, and transmission at an index. */
inline Spectrum gltf_facets(GltfSurface m, GltfParts p, vec3 wo, vec3 wi, real index)
{
    mask front = wo.z > 0.0f, crossed = wo.z * wi.z < 0.0f;
    RefractingFacet h = sheet_facet(m.thin != 0, USES_GLTF_SURFACE_TRANSMISSION, wo, wi, index);
    real v = microfacet_visible_pdf(p.facets, wo, h.h) * h.jacobian;
    v *= microfacet_g1(p.facets, sheet_seen(m.thin != 0, wo, wi), h.h);
    Spectrum f0 = p.f0;
    FilmBase film = p.film;
    real f90 = p.f90, c = gltf_cosine(m, h.o, index), share = sel(front, (real)(1.0f), p.passed);
    if (USES_GLTF_SURFACE_TRANSMISSION) {
        f0 = spectrum_sel(crossed, p.base_f0, f0);
        f90 = sel(crossed, m.specular, f90);
        film.reflectance = spectrum_sel(crossed, p.base_film.reflectance, film.reflectance);
        film.shift = spectrum_sel(crossed, p.base_film.shift, film.shift);
    }
    Spectrum f = gltf_reflectance(m, f0, f90, film, c);
    if (USES_GLTF_SURFACE_TRANSMISSION) {
        real scale = sel(m.thin != 0, (real)(1.0f), sel(front, 1.0f / sqr(index), sqr(index)));
        Spectrum passed = spectrum_sub(spectrum_of(1.0f), layer_cover(f));
        f = spectrum_sel(crossed, spectrum_mul(passed, m.base_color), f);
        share = sel(crossed, scale * p.passed, share);
    } else
        share = sel(crossed, (real)(0.0f), share);
    return spectrum_scale(f, sel(h.shading, v * share, (real)(0.0f)));
}

/* f |cos| of turned directions. */
inline Spectrum gltf_value(GltfSurface m, GltfParts p, vec3 wo, vec3 wi)
{
    mask front = wo.z > 0.0f, reflected = wo.z * wi.z > 0.0f, crossed = wo.z * wi.z < 0.0f;
    mask seen = front | (p.passed > 0.0f) | (p.through > 0.0f);
    real cos_o = fabs(wo.z), cos_i = fabs(wi.z);
    Spectrum v = gltf_facets(m, p, wo, wi, p.eta.x);
    if (any(spectrum_varies(p.eta) & (m.transmission > 0.0f))) {
#define C(c) v.c = gltf_facets(m, p, wo, wi, p.eta.c).c;
        SPECTRUM_EACH(C)
#undef C
    }
    Spectrum under = gltf_under(m, p, cos_o, cos_i, front, crossed & (m.thin == 0));
    real back = sel(front & reflected, p.scattered * cos_i * INV_PI, (real)(0.0f));
    v = spectrum_add(v, spectrum_scale(spectrum_mul(under, m.base_color), back));
    if (USES_GLTF_SURFACE_MULTIPLE_SCATTERING) {
        real lost = gltf_lost(facet_albedo(cos_o, p.roughness)) * gltf_lost(facet_albedo(cos_i, p.roughness));
        lost = lost / max_r(gltf_lost(facet_albedo_mean(p.roughness)), (real)(1e-3f)) * cos_i * INV_PI;
        v = spectrum_madd(gltf_bounced(m, p, p.f0, p.f90), sel(front & reflected, lost, (real)(0.0f)), v);
    }
    if (USES_GLTF_SURFACE_DIFFUSE_TRANSMISSION) {
        real passing = sel(crossed, p.through * cos_i * INV_PI, (real)(0.0f));
        v = spectrum_add(v, spectrum_scale(spectrum_mul(under, m.diffuse_transmission_color), passing));
    }
    real z_o = sel(m.thin != 0, cos_o, wo.z), z_i = sel(m.thin != 0, cos_i, wi.z);
    mask outside = front & reflected;
    /* read where light is reflected */
    RefractingFacet h = sheet_facet(m.thin != 0, USES_GLTF_SURFACE_TRANSMISSION, wo, wi, p.eta.x);
    if (USES_GLTF_SURFACE_SHEEN_COLOR) {
        real most = max_r(gltf_sheen_albedo(m, z_o), gltf_sheen_albedo(m, z_i));
        Spectrum cover = layer_cover(m.sheen_color);
        real fibres = charlie(cos_o, cos_i, h.h, m.sheen_roughness);
        v = spectrum_sub(v, spectrum_scale(spectrum_mul(v, cover), most));
        v = spectrum_madd(m.sheen_color, sel(outside, fibres, (real)(0.0f)), v);
    }
    if (USES_GLTF_SURFACE_CLEARCOAT) {
        vec3 coat_o = gltf_coated(m, wo), coat_i = gltf_coated(m, wi), coat_h = gltf_coated(m, h.h);
        real coat = microfacet_visible_pdf(p.coat, coat_o, coat_h) * h.jacobian * microfacet_g1(p.coat, coat_i, coat_h);
        coat *= m.clearcoat * gltf_schlick((real)(0.04f), (real)(1.0f), fabs(h.o));
        if (USES_GLTF_SURFACE_CLEARCOAT_APART) {
            z_o = sel(m.thin != 0, fabs(coat_o.z), coat_o.z);
            z_i = sel(m.thin != 0, fabs(coat_i.z), coat_i.z);
            coat *= gltf_coat_lean(coat_o.z, wo.z);
            coat *= min_r(cos_i / max_r(coat_i.z, (real)(1e-6f)), (real)(1.0f));
            outside = outside & (coat_o.z > 0.0f) & (coat_i.z > 0.0f);
        }
        v = spectrum_scale(v, 1.0f - max_r(gltf_coat_albedo(m, z_o), gltf_coat_albedo(m, z_i)));
        v = spectrum_add(v, spectrum_of(sel(h.shading & outside, coat, (real)(0.0f))));
    }
    return spectrum_sel(seen & (reflected | crossed), v, spectrum_of(0.0f));
}

/* pdf of turned directions for a hero with this index. */
inline real gltf_density(GltfSurface m, GltfParts p, GltfLobes l, vec3 wo, vec3 wi, real index)
{
    mask reflected = wo.z * wi.z > 0.0f, crossed = wo.z * wi.z < 0.0f;
    RefractingFacet h = sheet_facet(m.thin != 0, USES_GLTF_SURFACE_TRANSMISSION, wo, wi, index);
    real turned = gltf_reflects(m, p, gltf_cosine(m, h.o, index));
    real facets = microfacet_visible_pdf(p.facets, wo, h.h) * sel(crossed, 1.0f - turned, turned) * l.facets;
    if (USES_GLTF_SURFACE_CLEARCOAT) {
        vec3 coat_h = gltf_coated(m, h.h);
        real coat = microfacet_visible_pdf(p.coat, gltf_coated(m, wo), coat_h) * l.coat;
        if (USES_GLTF_SURFACE_CLEARCOAT_APART)
            coat = sel(coat_h.z > 0.0f, coat, (real)(0.0f));
        facets += sel(crossed, (real)(0.0f), coat);
    }
    real back = sel(wo.z > 0.0f, l.sheen * INV_2PI + l.scattered * cosine_hemisphere_pdf(wi.z), (real)(0.0f));
    real pdf = sel(crossed, l.through * cosine_hemisphere_pdf(fabs(wi.z)), back);
    pdf += sel(h.shading, facets * h.jacobian, (real)(0.0f));
    return sel(reflected | (crossed & ((p.passed > 0.0f) | (p.through > 0.0f))), pdf, (real)(0.0f));
}

Spectrum gltf_surface_eval(GltfSurface m, vec3 wo, vec3 wi)
{
    GltfPair w = gltf_pair(m, wo, wi);
    return gltf_value(m, gltf_parts(m), w.wo, w.wi);
}

real gltf_surface_pdf(GltfSurface m, vec3 wo, vec3 wi)
{
    GltfPair w = gltf_pair(m, wo, wi);
    GltfParts p = gltf_parts(m);
    return gltf_density(m, p, gltf_lobes(m, p, w.wo), w.wo, w.wi, p.eta.x);
}

Spectrum gltf_surface_pdfs(GltfSurface m, vec3 wo, vec3 wi)
{
    GltfPair w = gltf_pair(m, wo, wi);
    GltfParts p = gltf_parts(m);
    GltfLobes l = gltf_lobes(m, p, w.wo);
    Spectrum v = spectrum_of(gltf_density(m, p, l, w.wo, w.wi, p.eta.x));
    if (any(spectrum_varies(p.eta))) {
#define C(c) v.c = gltf_density(m, p, l, w.wo, w.wi, p.eta.c);
        SPECTRUM_EACH(C)
#undef C
    }
    return v;
}

BsdfSample gltf_surface_sample(GltfSurface m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    GltfPair w = gltf_pair(m, wo, wo);
    GltfParts p = gltf_parts(m);
    GltfLobes l = gltf_lobes(m, p, w.wo);
    real before = l.coat + l.sheen + l.scattered + l.through;
    mask coat = u.z < l.coat, facets = u.z >= before, up = w.wo.z > 0.0f;
    mask sheen = !coat & (u.z < l.coat + l.sheen), through = !facets & (u.z >= l.coat + l.sheen + l.scattered);
    vec2 uv = {u.x, u.y};
    Microfacets d = p.facets;
    d.alpha_u = sel(coat, p.coat.alpha_u, d.alpha_u);
    d.alpha_v = sel(coat, p.coat.alpha_v, d.alpha_v);
    vec3 seen = w.wo;
    if (USES_GLTF_SURFACE_CLEARCOAT_APART)
        seen = sel3(coat, gltf_coated(m, w.wo), seen);
    vec3 h = microfacet_visible(d, scale3(seen, sel(up, (real)(1.0f), (real)(-1.0f))), uv);
    if (USES_GLTF_SURFACE_CLEARCOAT_APART)
        h = sel3(coat, to_world(frame_of(gltf_coat_normal(m)), h), h);
    real o = dot3(w.wo, h), thin_z = sel(m.thin != 0, (real)(-1.0f), (real)(1.0f));
    real split = gltf_reflects(m, p, gltf_cosine(m, o, p.eta.x));
    real v = (u.z - before) / max_r(1.0f - before, (real)(1e-6f));
    mask passes = facets & (v >= split);
    w.wi = reflect_at(w.wo, h);
    Fresnel f = fresnel_dielectric(o, p.eta.x);
    if (USES_GLTF_SURFACE_TRANSMISSION) {
        vec3 refracted = normalize3(sub3(scale3(h, o / f.eta + f.cos_t), scale3(w.wo, 1.0f / f.eta)));
        vec3 straight = v3(w.wi.x, w.wi.y, -w.wi.z);
        w.wi = sel3(passes, sel3(m.thin != 0, straight, refracted), w.wi);
    }
    vec3 even = cosine_hemisphere(uv);
    even.z *= sel(through & up, (real)(-1.0f), (real)(1.0f));
    w.wi = sel3(coat | facets, w.wi, even);
    if (USES_GLTF_SURFACE_SHEEN_COLOR) {
        vec3 ball = uniform_sphere(uv);
        w.wi = sel3(sheen, v3(ball.x, ball.y, fabs(ball.z)), w.wi);
    }
    mask crossing = passes | through;
    mask kept = sel_i(crossing, w.wo.z * w.wi.z < 0.0f, w.wo.z * w.wi.z > 0.0f) != 0;
    s.pdf = sel(kept, gltf_density(m, p, l, w.wo, w.wi, p.eta.x), (real)(0.0f));
    s.weight = spectrum_scale(gltf_value(m, p, w.wo, w.wi), sel(s.pdf > 0.0f, 1.0f / s.pdf, (real)(0.0f)));
    s.wi = gltf_turn(m, w.wi, (real)(-1.0f));
    s.wi.z *= gltf_side(m, wo);
    s.eta = sel(passes & (m.thin == 0), f.eta, (real)(1.0f));
    s.lobe = sel_i(crossing, (integer)(LOBE_TRANSMIT), (integer)(LOBE_REFLECT));
    return s;
}

Spectrum gltf_surface_albedo(GltfSurface m) { return m.base_color; }

real gltf_surface_across(GltfSurface m) { return sel(m.thin != 0, (real)(1.0f), gltf_parts(m).eta.x); }
