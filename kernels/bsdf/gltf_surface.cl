/* glTF 2.0's material with its extensions (glTF 2.0 appendix B; KHR_materials_anisotropy, _clearcoat,
 * _diffuse_transmission, _ior, _iridescence, _sheen, _specular, _transmission, _volume): from the outside
 * in a clear coat, sheen, and microfacets over a base that scatters light back, scatters it through or
 * lets it through, all mixed with a metal. A layer dims what lies under it by its directional albedo.
 * f [1/sr]. Front side; both sides where light goes through; thin: both sides are alike, light is not refracted. */
#include "optics/gltf_layers.cl"

/* Both directions as the lobes see them: along and across the anisotropy, thin ones' back turned up. */
typedef struct { vec3 wo, wi; } GltfPair;
inline vec3 gltf_turn(GltfSurface m, vec3 w, real sign)
{
    if (any(m.anisotropy > 0.0f)) {
        real s, c, turns = m.anisotropy_rotation * (1.0f / 360.0f);
        sincos_2pi(turns - floor(turns), &s, &c);
        s *= sign;
        w = v3(c * w.x + s * w.y, c * w.y - s * w.x, w.z);
    }
    return w;
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

/* What all functions ask of the parameters. */
typedef struct {
    Microfacets facets;
    real roughness;            /* that of the albedo of stretched facets, too */
    Spectrum eta, f0, base_f0; /* index; reflectance at normal incidence of all, of the dielectric alone */
    real f90;                  /* of all at grazing angles; the dielectric's is m.specular */
    real passed;               /* share of what is let through under the facets */
    real scattered, through;   /* shares of what is scattered back, and to the other side */
} GltfParts;

inline GltfParts gltf_parts(GltfSurface m)
{
    GltfParts p;
    real r = clamp_r(m.roughness, (real)(0.0316f), (real)(1.0f)), alpha = r * r, dielectric = 1.0f - m.metallic;
    real along = alpha + (1.0f - alpha) * sqr(m.anisotropy);
    p.facets = microfacets_of((integer)(0), along, alpha);
    p.roughness = sqrt(sqrt(along * alpha));
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
    mask refracts = (m.thin == 0) & (m.transmission > 0.0f);
    if (any(refracts)) {
        real eta = sel(c < 0.0f, 1.0f / index, index), cos2 = 1.0f - (1.0f - x * x) / (eta * eta);
        x = sel(refracts & (eta < 1.0f), sel(cos2 > 0.0f, sqrt_r(cos2), (real)(-1.0f)), x);
    }
    return x;
}
inline Spectrum gltf_schlick(Spectrum f0, real f90, real c)
{
    Spectrum f;
    real x = 1.0f - c, weight = x * x * x * x * x;
#define C(c) f.c = sel(weight > 1.0f, (real)(1.0f), f0.c + (f90 - f0.c) * weight);
    SPECTRUM_EACH(C)
#undef C
    return f;
}
/* With a film on it. */
inline Spectrum gltf_facet(GltfSurface m, Spectrum f0, real f90, real c)
{
    Spectrum f = gltf_schlick(f0, f90, c);
    if (any(m.iridescence > 0.0f)) {
        Spectrum film = iridescence(max_r(c, (real)(0.0f)), f0, m.iridescence_ior, m.iridescence_thickness, m.lambdas);
        f = spectrum_madd(spectrum_sub(film, f), sel(c < 0.0f, (real)(0.0f), m.iridescence), f);
    }
    return f;
}

/* What the dielectric's facets leave to a base that scatters: (1 - E(o)) (1 - E(i)) / (1 - mean E), which
 * loses nothing; with a film the lesser of both, which loses a little. E is the directional albedo. */
inline Spectrum gltf_under(GltfSurface m, GltfParts p, real cos_o, real cos_i, mask refracted)
{
    FacetAlbedo o = facet_albedo(cos_o, p.roughness), i = facet_albedo(cos_i, p.roughness);
    FacetAlbedo mean = facet_albedo_mean(p.roughness);
    Spectrum v;
#define C(c)                                                                                 \
    {                                                                                        \
        real left_o = 1.0f - p.base_f0.c * o.a - m.specular * o.b;                           \
        real left_i = 1.0f - p.base_f0.c * i.a - m.specular * i.b;                           \
        real left = max_r(1.0f - p.base_f0.c * mean.a - m.specular * mean.b, (real)(1e-3f)); \
        v.c = sel(refracted, left_o, left_o * left_i / left);                                \
    }
    SPECTRUM_EACH(C)
#undef C
    if (any(m.iridescence > 0.0f)) {
        Spectrum film_o = layer_cover(iridescence(cos_o, p.f0, m.iridescence_ior, m.iridescence_thickness, m.lambdas));
        Spectrum film_i = layer_cover(iridescence(cos_i, p.f0, m.iridescence_ior, m.iridescence_thickness, m.lambdas));
#define C(c)                                                                                \
        {                                                                                   \
            real left = min_r(1.0f - film_o.c * (o.a + o.b),                                \
                              sel(refracted, (real)(1.0f), 1.0f - film_i.c * (i.a + i.b))); \
            v.c += (left - v.c) * m.iridescence;                                            \
        }
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
inline Microfacets gltf_coat_facets(GltfSurface m)
{
    real a = sqr(clamp_r(m.clearcoat_roughness, (real)(0.0316f), (real)(1.0f)));
    return microfacets_of((integer)(0), a, a);
}

/* Probabilities of the lobes by the strengths that wo sees; `facets` is of those under the coat. */
typedef struct { real coat, sheen, scattered, through, facets; } GltfLobes;
inline GltfLobes gltf_lobes(GltfSurface m, GltfParts p, vec3 wo)
{
    mask front = wo.z > 0.0f;
    real colour = spectrum_mean(m.base_color), c = fabs(wo.z);
    FacetAlbedo e = facet_albedo(c, p.roughness);
    GltfLobes l = {(real)(0.0f), (real)(0.0f), (real)(0.0f), (real)(0.0f), (real)(0.0f)};
    if (any(m.clearcoat > 0.0f)) l.coat = gltf_coat_albedo(m, wo.z);
    if (any(spectrum_max(m.sheen_color) > 0.0f))
        l.sheen = (1.0f - l.coat) * gltf_sheen_albedo(m, wo.z) * spectrum_mean(m.sheen_color);
    real rest = max_r(1.0f - l.coat - l.sheen, (real)(0.05f)), film = 0.25f * m.iridescence;
    real left = max_r(1.0f - spectrum_mean(p.base_f0) * e.a - m.specular * e.b, (real)(0.05f));
    real mirrored = spectrum_mean(p.f0) * e.a + p.f90 * e.b + film;
    l.facets = sel(front, rest * (mirrored + left * p.passed * colour),
                   sel(p.passed > 0.0f, (real)(1.0f), (real)(0.0f)));
    l.scattered = sel(front, rest * left * p.scattered * colour, (real)(0.0f));
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
    real f = spectrum_mean(gltf_schlick(p.f0, p.f90, c)) + 0.25f * m.iridescence;
    real t = (1.0f - spectrum_mean(gltf_schlick(p.base_f0, m.specular, c))) * p.passed * spectrum_mean(m.base_color);
    return sel(p.passed > 0.0f, f / max_r(f + t, (real)(1e-6f)), (real)(1.0f));
}

/* The facet that lets light through from wi to wo, at one index. */
inline RefractingFacet gltf_passing(GltfSurface m, vec3 wo, vec3 wi, real index)
{
    mask thin = m.thin != 0;
    real eta = sel(thin, (real)(1.0f), sel(wo.z > 0.0f, index, 1.0f / index));
    vec3 mirrored = v3(wi.x, wi.y, sel(thin, -wi.z, wi.z));
    return refracting_facet(wo, mirrored, eta);
}

/* f |cos| of what is let through, but for its colour. */
inline Spectrum gltf_passed(GltfSurface m, GltfParts p, vec3 wo, vec3 wi, real index)
{
    RefractingFacet t = gltf_passing(m, wo, wi, index);
    vec3 seen = v3(wi.x, wi.y, sel(m.thin != 0, -wi.z, wi.z));
    real scale = sel(m.thin != 0, (real)(1.0f), sel(wo.z > 0.0f, 1.0f / sqr(index), sqr(index)));
    real v = microfacet_visible_pdf(p.facets, wo, t.h) * t.jacobian * microfacet_g1(p.facets, seen, t.h) * scale;
    Spectrum f = layer_cover(gltf_facet(m, p.base_f0, m.specular, gltf_cosine(m, t.o, index)));
    return spectrum_scale(spectrum_sub(spectrum_of(1.0f), f), sel(t.shading, v * p.passed, (real)(0.0f)));
}

/* f |cos| of turned directions. */
inline Spectrum gltf_value(GltfSurface m, GltfParts p, vec3 wo, vec3 wi)
{
    mask front = wo.z > 0.0f, reflected = wo.z * wi.z > 0.0f, crossed = wo.z * wi.z < 0.0f;
    mask seen = front | (p.passed > 0.0f) | (p.through > 0.0f);
    real cos_o = fabs(wo.z), cos_i = fabs(wi.z);
    RefractingFacet h = refracting_facet(wo, wi, (real)(1.0f));
    real facets = microfacet_visible_pdf(p.facets, wo, h.h) * h.jacobian * microfacet_g1(p.facets, wi, h.h);
    Spectrum f = gltf_facet(m, p.f0, p.f90, gltf_cosine(m, h.o, p.eta.x));
    if (any(spectrum_varies(p.eta) & !front)) {
#define C(c) f.c = gltf_facet(m, p.f0, p.f90, gltf_cosine(m, h.o, p.eta.c)).c;
        SPECTRUM_EACH(C)
#undef C
    }
    real share = sel(front, (real)(1.0f), p.passed);
    Spectrum v = spectrum_scale(f, sel(h.shading & reflected, facets * share, (real)(0.0f)));
    if (any(crossed & (p.passed > 0.0f))) {
        Spectrum t = gltf_passed(m, p, wo, wi, p.eta.x);
        if (any(spectrum_varies(p.eta))) {
#define C(c) t.c = gltf_passed(m, p, wo, wi, p.eta.c).c;
            SPECTRUM_EACH(C)
#undef C
        }
        v = spectrum_sel(crossed, spectrum_mul(t, m.base_color), v);
    }
    mask refracted = crossed & (m.thin == 0);
    if (any((p.scattered > 0.0f) | (p.through > 0.0f))) {
        real entered = sel(front, cos_o, cos_i); /* the cosine on the outside, for a body */
        Spectrum under = gltf_under(m, p, sel(refracted, entered, cos_o), sel(refracted, entered, cos_i), refracted);
        real back = sel(front & reflected, p.scattered * cos_i * INV_PI, (real)(0.0f));
        v = spectrum_add(v, spectrum_scale(spectrum_mul(under, m.base_color), back));
        if (any(p.through > 0.0f)) {
            real passing = sel(crossed, p.through * cos_i * INV_PI, (real)(0.0f));
            v = spectrum_add(v, spectrum_scale(spectrum_mul(under, m.diffuse_transmission_color), passing));
        }
    }
    real z_o = sel(m.thin != 0, cos_o, wo.z), z_i = sel(m.thin != 0, cos_i, wi.z);
    mask outside = front & reflected;
    if (any(spectrum_max(m.sheen_color) > 0.0f)) {
        real most = max_r(gltf_sheen_albedo(m, z_o), gltf_sheen_albedo(m, z_i));
        Spectrum cover = layer_cover(m.sheen_color);
        real fibres = charlie(cos_o, cos_i, h.h, m.sheen_roughness);
        v = spectrum_sub(v, spectrum_scale(spectrum_mul(v, cover), most));
        v = spectrum_madd(m.sheen_color, sel(outside, fibres, (real)(0.0f)), v);
    }
    if (any(m.clearcoat > 0.0f)) {
        Microfacets d = gltf_coat_facets(m);
        real coat = microfacet_visible_pdf(d, wo, h.h) * h.jacobian * microfacet_g1(d, wi, h.h), y = 1.0f - fabs(h.o);
        coat *= m.clearcoat * (0.04f + 0.96f * y * y * y * y * y);
        v = spectrum_scale(v, 1.0f - max_r(gltf_coat_albedo(m, z_o), gltf_coat_albedo(m, z_i)));
        v = spectrum_add(v, spectrum_of(sel(h.shading & outside, coat, (real)(0.0f))));
    }
    return spectrum_sel(seen & (reflected | crossed), v, spectrum_of(0.0f));
}

/* pdf of turned directions, were the hero's index this one. */
inline real gltf_density(GltfSurface m, GltfParts p, GltfLobes l, vec3 wo, vec3 wi, real index)
{
    mask reflected = wo.z * wi.z > 0.0f, crossed = wo.z * wi.z < 0.0f;
    RefractingFacet h = refracting_facet(wo, wi, (real)(1.0f));
    real facets = microfacet_visible_pdf(p.facets, wo, h.h) * gltf_reflects(m, p, gltf_cosine(m, h.o, index)) *
                  l.facets;
    if (any(l.coat > 0.0f)) facets += microfacet_visible_pdf(gltf_coat_facets(m), wo, h.h) * l.coat;
    real pdf = sel(h.shading, facets * h.jacobian, (real)(0.0f));
    pdf += sel(wo.z > 0.0f, l.sheen * INV_2PI + l.scattered * cosine_hemisphere_pdf(wi.z), (real)(0.0f));
    if (any(crossed & ((p.passed > 0.0f) | (p.through > 0.0f)))) {
        RefractingFacet t = gltf_passing(m, wo, wi, index);
        real passes = (1.0f - gltf_reflects(m, p, gltf_cosine(m, t.o, index))) * l.facets;
        passes *= microfacet_visible_pdf(p.facets, wo, t.h) * t.jacobian;
        real behind = sel(t.shading, passes, (real)(0.0f)) + l.through * cosine_hemisphere_pdf(fabs(wi.z));
        pdf = sel(crossed, behind, pdf);
    }
    return sel(reflected | (crossed & ((p.passed > 0.0f) | (p.through > 0.0f))), pdf, (real)(0.0f));
}

inline Spectrum gltf_surface_eval(GltfSurface m, vec3 wo, vec3 wi)
{
    GltfPair w = gltf_pair(m, wo, wi);
    return gltf_value(m, gltf_parts(m), w.wo, w.wi);
}

inline real gltf_surface_pdf(GltfSurface m, vec3 wo, vec3 wi)
{
    GltfPair w = gltf_pair(m, wo, wi);
    GltfParts p = gltf_parts(m);
    return gltf_density(m, p, gltf_lobes(m, p, w.wo), w.wo, w.wi, p.eta.x);
}

inline Spectrum gltf_surface_pdfs(GltfSurface m, vec3 wo, vec3 wi)
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

inline BsdfSample gltf_surface_sample(GltfSurface m, vec3 wo, vec3 u)
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
    if (any(coat)) {
        Microfacets own = gltf_coat_facets(m);
        d.alpha_u = sel(coat, own.alpha_u, d.alpha_u);
        d.alpha_v = sel(coat, own.alpha_v, d.alpha_v);
    }
    vec3 h = microfacet_visible(d, scale3(w.wo, sel(up, (real)(1.0f), (real)(-1.0f))), uv);
    real o = dot3(w.wo, h), thin_z = sel(m.thin != 0, (real)(-1.0f), (real)(1.0f));
    real split = gltf_reflects(m, p, gltf_cosine(m, o, p.eta.x));
    real v = (u.z - before) / max_r(1.0f - before, (real)(1e-6f));
    mask passes = facets & (v >= split);
    w.wi = reflect_at(w.wo, h);
    Fresnel f = fresnel_dielectric(o, p.eta.x);
    if (any(passes)) {
        vec3 refracted = normalize3(sub3(scale3(h, o / f.eta + f.cos_t), scale3(w.wo, 1.0f / f.eta)));
        vec3 straight = v3(w.wi.x, w.wi.y, -w.wi.z);
        w.wi = sel3(passes, sel3(m.thin != 0, straight, refracted), w.wi);
    }
    vec3 even = cosine_hemisphere(uv);
    even.z *= sel(through & up, (real)(-1.0f), (real)(1.0f));
    w.wi = sel3(coat | facets, w.wi, even);
    if (any(sheen)) {
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

inline Spectrum gltf_surface_albedo(GltfSurface m) { return m.base_color; }
