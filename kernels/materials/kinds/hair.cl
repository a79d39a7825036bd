/* A fibre of hair, seen from near (Chiang et al. 2016, "A Practical and Controllable Hair and Fur Model
 * for Production Path Tracing", after Marschner et al. 2003 and d'Eon et al. 2011), as Mitsuba 3 and pbrt 4
 * have it. Local y runs along the fibre, z is its normal: where wo meets the round fibre follows from
 * both. Light is reflected (p = 0), passes (1), is reflected once inside (2), or more often (the rest):
 * of each the product of a longitudinal and an azimuthal distribution and the share that is left.
 * f |cos| [1/sr]. All leaves from where wo came in; the fibre's far side is taken for nothing. */
#include "materials/fresnel.cl"
#include "core/math.cl"
#define HAIR_LOBES 4
#define HAIR_NARROWEST 0.01f /* roughness, below which lobes are too narrow for float32 */

typedef struct {
    real sin_o, cos_o;         /* of the angle between wo and the plane across the fibre */
    real phi_o, gamma_o;       /* azimuth of wo; from wo to the normal, across the fibre */
    real gamma_t;              /* the same after refraction */
    real v, s;                 /* longitudinal variance of p = 0, azimuthal scale */
    real tilt_sin, tilt_cos;   /* of the scales' angle */
    real p[HAIR_LOBES];        /* probabilities */
    Spectrum a[HAIR_LOBES];    /* shares of the light */
} HairFibre;

inline real hair_power20(real x) { real x2 = x * x, x4 = x2 * x2, x8 = x4 * x4; return x8 * x8 * x4; }

/* What depends on wo alone. */
inline HairFibre hair_fibre(Hair m, vec3 wo)
{
    HairFibre r;
    real eta = max_r(m.eta, (real)(1.0001f)), across = sqrt_r(wo.x * wo.x + wo.z * wo.z);
    r.sin_o = clamp_r(wo.y, (real)(-1.0f), (real)(1.0f));
    r.cos_o = across;
    r.phi_o = atan2_r(wo.z, wo.x);
    r.gamma_o = atan2_r(-wo.x, wo.z);
    real h = -wo.x / max_r(across, (real)(1e-12f));

    real eta_across = sqrt_r(eta * eta - r.sin_o * r.sin_o) / max_r(across, (real)(1e-6f));
    real sin_gamma = h / eta_across, cos_gamma = sqrt_r(1.0f - sin_gamma * sin_gamma);
    r.gamma_t = atan2_r(sin_gamma, cos_gamma);
    real cos_theta = sqrt_r(1.0f - sqr(r.sin_o / eta));
    real f = fresnel_dielectric(across * sqrt_r(1.0f - h * h), eta).f, length = 2.0f * cos_gamma / cos_theta;
    real total = 0.0f;
#define C(c)                                                              \
    {                                                                     \
        real t = exp_r(-max_r(m.sigma_a.c, (real)(0.0f)) * length);       \
        r.a[0].c = f;                                                     \
        r.a[1].c = sqr(1.0f - f) * t;                                     \
        r.a[2].c = r.a[1].c * t * f;                                      \
        r.a[3].c = r.a[2].c * t * f / max_r(1.0f - t * f, (real)(1e-6f)); \
    }
    SPECTRUM_EACH(C)
#undef C
    for (int p = 0; p < HAIR_LOBES; p++) total += r.p[p] = spectrum_mean(r.a[p]);
    for (int p = 0; p < HAIR_LOBES; p++) r.p[p] /= total;

    real bm = max_r(m.longitudinal_roughness, (real)(HAIR_NARROWEST));
    real bn = max_r(m.azimuthal_roughness, (real)(HAIR_NARROWEST));
    r.v = sqr(0.726f * bm + 0.812f * bm * bm + 3.7f * hair_power20(bm));
    r.s = 0.626657069f * (0.265f * bn + 1.194f * bn * bn + 5.372f * bn * bn * hair_power20(bn)); /* sqrt(pi / 8) */
    real turn = m.scale_tilt * (1.0f / 360.0f);
    sincos_2pi(turn - floor(turn), &r.tilt_sin, &r.tilt_cos);
    return r;
}

inline real hair_variance(HairFibre r, int p) { return r.v * (p == 0 ? 1.0f : p == 1 ? 0.25f : 4.0f); }

/* Sine and cosine of wo's angle, turned by the scales: by -2, 1 and 4 times theirs for p = 0, 1 and 2. */
inline vec2 hair_tilted(HairFibre r, int p)
{
    real s = p == 0 ? -r.tilt_sin : r.tilt_sin, c = r.tilt_cos;
    for (int i = 0; i < (p == 0 ? 1 : p == 1 ? 0 : 2); i++) { /* doubled */
        real twice = 2.0f * s * c;
        c = c * c - s * s;
        s = twice;
    }
    vec2 turned = {r.sin_o * c + r.cos_o * s, fabs(r.cos_o * c - r.sin_o * s)};
    vec2 plain = {r.sin_o, r.cos_o};
    return p < 3 ? turned : plain;
}

/* Longitudinal, per projected solid angle (d'Eon et al. 2011 eq. 7). */
inline real hair_longitudinal(vec2 o, real sin_i, real cos_i, real v)
{
    real across = cos_i * o.y / v;
    real scale = exp_r((cos_i * o.y - sin_i * o.x - 1.0f) / v);
    return bessel_i0_scaled(across) * scale / (v * (1.0f - exp_r(-2.0f / v)));
}

/* Azimuthal: a logistic distribution about where an ideal fibre would send the light, cut off at pi. */
inline real hair_ideal(HairFibre r, int p) { return 2.0f * (float)p * r.gamma_t - 2.0f * r.gamma_o + (float)p * PI; }
inline real hair_azimuthal(HairFibre r, int p, real turned)
{
    real off = (turned - hair_ideal(r, p)) * INV_2PI;
    off = fabs(off - floor(off + 0.5f)) * (2.0f * PI);
    real e = exp_r(-off / r.s), last = exp_r(-PI / r.s);
    return e * (1.0f + last) / (r.s * sqr(1.0f + e) * (1.0f - last));
}

/* Of each lobe the density of wi [1/sr]. */
inline void hair_densities(HairFibre r, vec3 wi, real *d)
{
    real sin_i = clamp_r(wi.y, (real)(-1.0f), (real)(1.0f)), cos_i = sqrt_r(wi.x * wi.x + wi.z * wi.z);
    real turned = atan2_r(wi.z, wi.x) - r.phi_o;
    for (int p = 0; p < HAIR_LOBES; p++) {
        d[p] = hair_longitudinal(hair_tilted(r, p), sin_i, cos_i, hair_variance(r, p));
        d[p] *= p < 3 ? hair_azimuthal(r, p, turned) : (real)(INV_2PI);
    }
}

inline Spectrum hair_value(HairFibre r, const real *d)
{
    Spectrum v = spectrum_of(0.0f);
    for (int p = 0; p < HAIR_LOBES; p++) v = spectrum_madd(r.a[p], d[p], v);
    return v;
}
inline real hair_density(HairFibre r, const real *d)
{
    return r.p[0] * d[0] + r.p[1] * d[1] + r.p[2] * d[2] + r.p[3] * d[3];
}

Spectrum hair_eval(Hair m, vec3 wo, vec3 wi)
{
    HairFibre r = hair_fibre(m, wo);
    real d[HAIR_LOBES];
    hair_densities(r, wi, d);
    return hair_value(r, d);
}

real hair_pdf(Hair m, vec3 wo, vec3 wi)
{
    HairFibre r = hair_fibre(m, wo);
    real d[HAIR_LOBES];
    hair_densities(r, wi, d);
    return hair_density(r, d);
}

BsdfSample hair_sample(Hair m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    HairFibre r = hair_fibre(m, wo);
    /* The lobe; where u.z lies within its share serves again, for the azimuth. */
    real chosen = 0.0f, from = 0.0f, share = r.p[0], v = hair_variance(r, 0), ideal = hair_ideal(r, 0), sum = 0.0f;
    vec2 o = hair_tilted(r, 0);
    for (int p = 1; p < HAIR_LOBES; p++) {
        sum += r.p[p - 1];
        mask beyond = (u.z >= sum) & (r.p[p] > 0.0f);
        vec2 own = hair_tilted(r, p);
        chosen = sel(beyond, (real)((float)p), chosen);
        from = sel(beyond, sum, from);
        share = sel(beyond, r.p[p], share);
        v = sel(beyond, (real)(hair_variance(r, p)), v);
        ideal = sel(beyond, hair_ideal(r, p), ideal);
        o.x = sel(beyond, own.x, o.x);
        o.y = sel(beyond, own.y, o.y);
    }
    real again = clamp_r((u.z - from) / max_r(share, (real)(1e-12f)), (real)(0.0f), (real)(0.9999999f));

    /* Longitudinal (d'Eon et al. 2013, "Importance Sampling for Physically-Based Hair Fiber Models"). */
    real low = exp_r(-2.0f / v), along = 1.0f + v * log_r(max_r(u.x + (1.0f - u.x) * low, (real)(1e-30f)));
    along = clamp_r(along, (real)(-1.0f), (real)(1.0f));
    real sin_phi, cos_phi;
    sincos_2pi(u.y, &sin_phi, &cos_phi);
    real sin_i = clamp_r(-along * o.x + sqrt_r(1.0f - along * along) * cos_phi * o.y, (real)(-1.0f), (real)(1.0f));
    real cos_i = sqrt_r(1.0f - sin_i * sin_i);

    /* Azimuthal: the logistic distribution's inverse between -pi and pi. */
    real last = 1.0f / (1.0f + exp_r(PI / r.s)), x = last + again * (1.0f - 2.0f * last);
    real off = clamp_r(-r.s * log_r(max_r(1.0f / max_r(x, (real)(1e-30f)) - 1.0f, (real)(1e-30f))), (real)(-PI),
                       (real)(PI));
    real phi = r.phi_o + sel(chosen < 3.0f, ideal + off, 2.0f * PI * again), sin_a, cos_a;
    phi *= INV_2PI;
    sincos_2pi(phi - floor(phi), &sin_a, &cos_a);
    s.wi = normalize3(v3(cos_i * cos_a, sin_i, cos_i * sin_a));

    real d[HAIR_LOBES];
    hair_densities(r, s.wi, d);
    s.pdf = hair_density(r, d);
    s.pdf = sel(s.pdf > 1e-20f, s.pdf, (real)(0.0f));
    s.weight = spectrum_scale(hair_value(r, d), sel(s.pdf > 0.0f, 1.0f / s.pdf, (real)(0.0f)));
    s.lobe = sel_i(wo.z * s.wi.z < 0.0f, (integer)(LOBE_TRANSMIT), (integer)(LOBE_REFLECT));
    return s;
}

/* The colour of many fibres (Chiang et al. 2016 eq. 9, turned round). */
Spectrum hair_albedo(Hair m)
{
    real b = m.azimuthal_roughness;
    real k = 5.969f + b * (-0.215f + b * (2.532f + b * (-10.73f + b * (5.574f + b * 0.245f))));
    Spectrum r;
#define C(c) r.c = exp_r(-sqrt_r(m.sigma_a.c) * k);
    SPECTRUM_EACH(C)
#undef C
    return r;
}
