/* A diffraction grating: grooves `period` [nm] apart, across the direction at `angle` to the tangent.
 * Order n leaves by the grating equation in conical mounting (Loewen and Popov 1997, 2.2; Born and
 * Wolf 1999, 8.6.1): along the surface, wi = -wo + n lambda / period. Orders that cannot leave drop
 * out, and the others share all the light. Reflective: front side; transmissive: both sides, the same
 * medium before and behind. The probability of order 0 is its mean share at the path's wavelengths, and it
 * keeps them all. The hero's shares choose another order, whose direction holds for the hero alone. */
#include "materials/fresnel.cl"
#include "materials/diffraction.cl"

#define GRATING_TRANSMISSIVE 1 /* of `mode` */

typedef struct {
    vec2 along;   /* unit vector along which the grooves follow each other */
    vec2 mirror;  /* order 0's direction along the surface */
    real lag;     /* what wo adds to the delay, per depth */
    mask through;
} GratingPlane;

/* Delay per depth of groove, along a leg at cosine c: through air, or through the plate against air. */
inline real grating_lag(mask through, real ior, real c)
{
    return sel(through, 0.5f * (sqrt_r(ior * ior - 1.0f + c * c) - c), c);
}

inline GratingPlane grating_plane(Grating m, vec3 wo)
{
    GratingPlane g;
    real turns = m.angle * (1.0f / 360.0f);
    sincos_2pi(turns - floor(turns), &g.along.y, &g.along.x);
    g.mirror.x = -wo.x;
    g.mirror.y = -wo.y;
    g.through = m.mode == GRATING_TRANSMISSIVE;
    g.lag = grating_lag(g.through, m.ior.x, fabs(wo.z));
    return g;
}

/* Where order n goes along the surface, and the cosine there; 0: nowhere. */
inline vec2 grating_order(Grating m, GratingPlane g, real n, real lambda, real *cosine)
{
    real step = n * lambda / max_r(m.period, (real)(1.0f));
    vec2 t = {g.mirror.x + step * g.along.x, g.mirror.y + step * g.along.y};
    real c2 = 1.0f - t.x * t.x - t.y * t.y;
    *cosine = sel((c2 > 1e-6f) | (n == 0.0f), sqrt_r(c2), (real)(0.0f));
    return t;
}

/* What the grooves' shape gives order n, which leaves at a cosine. */
inline real grating_share(Grating m, GratingPlane g, int n, mask leaves, real cosine, real lambda)
{
    real waves = m.depth * (g.lag + grating_lag(g.through, m.ior.x, cosine)) / lambda;
    real e = m.efficiencies[n + GRATING_ORDERS];
    mask sinusoidal = leaves & (m.profile == GRATING_SINUSOIDAL);
    mask lamellar = leaves & (m.profile == GRATING_LAMELLAR);
    mask blazed = leaves & (m.profile == GRATING_BLAZED);
    if (any(sinusoidal)) e = sel(sinusoidal, sinusoidal_share(n, waves), e);
    if (any(lamellar)) e = sel(lamellar, lamellar_share(n, waves, m.fill), e);
    if (any(blazed)) e = sel(blazed, blazed_share(n, waves), e);
    return e;
}

/* How strong order n is, before all that leave are made to share the light. */
inline real grating_strength(Grating m, GratingPlane g, int n, real lambda)
{
    real cosine, e = 0.0f;
    grating_order(m, g, (real)((float)n), lambda, &cosine);
    mask leaves = ((cosine > 0.0f) | mask_of(n == 0)) & ((float)abs(n) <= m.orders);
    if (any(leaves)) e = sel(leaves, grating_share(m, g, n, leaves, cosine, lambda), e);
    return e;
}

/* The share of order 0, and how strong all the others are together. */
inline real grating_straight(Grating m, GratingPlane g, real lambda, real *others)
{
    real zero = grating_strength(m, g, 0, lambda);
    *others = 0.0f;
    for (int n = -GRATING_ORDERS; n <= GRATING_ORDERS; n++)
        if (n != 0) *others += grating_strength(m, g, n, lambda);
    real total = zero + *others;
    return sel(total > 1e-12f, zero / max_r(total, (real)(1e-12f)), (real)(1.0f));
}

/* A random order other than 0, by the hero's strengths; its own goes to `strength`. */
inline real grating_choice(Grating m, GratingPlane g, real lambda, real left, real *strength)
{
    real chosen = 0.0f;
    mask found = mask_of(0);
    *strength = 0.0f;
    for (int n = -GRATING_ORDERS; n <= GRATING_ORDERS; n++) {
        real e = n == 0 ? (real)(0.0f) : grating_strength(m, g, n, lambda);
        mask take = !found & (e > 0.0f); /* the last order takes the remainder of rounding */
        chosen = sel(take, (real)((float)n), chosen);
        *strength = sel(take, e, *strength);
        found = found | (take & (left < e));
        left -= e;
    }
    return chosen;
}

inline Spectrum grating_reflectance(Grating m, real cosine)
{
    Spectrum f = spectrum_sel(m.mode == GRATING_TRANSMISSIVE, spectrum_of(1.0f), fresnel_conductor(cosine, m.eta, m.k));
    return spectrum_mul(m.reflectance, f);
}

BsdfSample grating_sample(Grating m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    GratingPlane g = grating_plane(m, wo);
    Parted at = part_wavelengths(m.lambdas, u.y);
    Spectrum straight, others;
#define C(c) straight.c = grating_straight(m, g, at.lambdas.c, &others.c);
    SPECTRUM_EACH(C)
#undef C
    real stays = spectrum_mean(straight), strength, cosine;
    mask keeps = u.z < stays;
    real order = sel(keeps, (real)(0.0f), grating_choice(m, g, at.lambdas.x, u.x * others.x, &strength));
    vec2 t = grating_order(m, g, order, at.lambdas.x, &cosine);
    real side = sel(wo.z < 0.0f, (real)(-1.0f), (real)(1.0f));
    cosine = sel(keeps, fabs(wo.z), cosine);
    s.wi = v3(t.x, t.y, cosine * sel(g.through, -side, side));
    real share = strength / max_r(others.x, (real)(1e-12f)), p = sel(keeps, stays, (1.0f - stays) * share);
    mask usable = (p > 0.0f) & (g.through | (wo.z > 0.0f)) & (keeps | (cosine > 0.0f));
    Spectrum kept = spectrum_mul(at.share, straight), parted = spectrum_scale(at.alone, (1.0f - straight.x) * share);
    Spectrum value = spectrum_mul(grating_reflectance(m, fabs(wo.z)), spectrum_sel(keeps, kept, parted));
    s.weight = spectrum_scale(value, 1.0f / sel(usable, p, (real)(1.0f)));
    s.pdf = sel(usable, p * at.pdf, (real)(0.0f));
    s.lobe = sel_i(g.through, (integer)(LOBE_TRANSMIT), (integer)(LOBE_REFLECT))
           | sel_i(keeps, (integer)(LOBE_DELTA), (integer)(LOBE_DELTA | LOBE_DISPERSE));
    return s;
}

Spectrum grating_eval(Grating m, vec3 wo, vec3 wi) { return spectrum_of(0.0f); }

real grating_pdf(Grating m, vec3 wo, vec3 wi) { return 0.0f; }

Spectrum grating_albedo(Grating m) { return grating_reflectance(m, (real)(1.0f)); }
