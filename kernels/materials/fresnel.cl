/* Fresnel's equations for unpolarised light: the share of radiance that a smooth boundary reflects.
 * Cosines are signed (negative inside); an index is always that of the inside over the outside. */
typedef struct {
    real f;     /* reflectance in [0, 1] */
    real cos_t; /* signed cosine of the refracted direction; 0 on total internal reflection */
    real eta;   /* index of the side that light is refracted to, over that of the side of cos_i */
} Fresnel;

/* The shares that two dielectrics reflect of light polarised across the plane of incidence and along it
 * (Born and Wolf 1999, 1.5.2); c, t: cosines before and behind, eta: index behind over that before. */
inline vec2 fresnel_polarised(real c, real t, real eta)
{
    vec2 r = {(c - eta * t) / max_r(c + eta * t, (real)(1e-20f)), (eta * c - t) / max_r(eta * c + t, (real)(1e-20f))};
    r.x *= r.x;
    r.y *= r.y;
    return r;
}

/* Two dielectrics. A relative index of 1 is no boundary: f = 0 at any angle. */
inline Fresnel fresnel_dielectric(real cos_i, real eta)
{
    Fresnel r;
    real c = fabs(cos_i);
    r.eta = sel(cos_i >= 0.0f, eta, 1.0f / eta);
    real cos2_t = 1.0f - (1.0f - c * c) / (r.eta * r.eta);
    real t = sqrt_r(cos2_t);
    vec2 both = fresnel_polarised(c, t, r.eta);
    real f = 0.5f * (both.x + both.y);
    f = sel((cos2_t <= 0.0f) | (c == 0.0f), (real)(1.0f), f);
    r.f = sel(eta == 1.0f, (real)(0.0f), f);
    r.cos_t = sel(cos_i >= 0.0f, -t, t);
    return r;
}

/* The reflectance per wavelength; computed once where the index does not vary. */
inline Spectrum fresnel_spectrum(real cos_i, Spectrum eta)
{
    Spectrum f = spectrum_of(fresnel_dielectric(cos_i, eta.x).f);
    if (any(spectrum_varies(eta))) {
#define C(c) SPECTRUM_PUT(f, c, fresnel_dielectric(cos_i, SPECTRUM_AT(eta, c)).f);
        SPECTRUM_IN_TURN(C)
#undef C
    }
    return f;
}

/* Index of a boundary. In RGB mode light is refracted as a whole, by the channels' mean. */
inline Spectrum relative_index(Spectrum inside, Spectrum outside)
{
    Spectrum eta = spectrum_div(inside, outside);
    return SPECTRUM_SIZE == 3 ? spectrum_of(spectrum_mean(eta)) : eta;
}

/* Vacuum and a metal of index eta + i k (Born and Wolf 1999, 14.4; as in Lazanyi and
 * Szirmay-Kalos 2005), cos_i >= 0. */
inline real fresnel_metal(real cos_i, real eta, real k)
{
    real c2 = cos_i * cos_i, s2 = 1.0f - c2;
    real d = eta * eta - k * k - s2;
    real q = sqrt_r(d * d + 4.0f * eta * eta * k * k); /* a^2 + b^2, where a + i b is the normal component */
    real large = sqrt_r(0.5f * (q + fabs(d))); /* of a and b; eta k is their product */
    real a = sel(d < 0.0f, eta * k / max_r(large, (real)(1e-15f)), large);
    real t = 2.0f * cos_i * a;
    real m = max_r(q + c2, (real)(1e-15f)), n = max_r(q * c2 + s2 * s2, (real)(1e-15f));
    /* s = (m - t) / (m + t) of light polarised across the plane of incidence, and s (n - t s2) / (n + t s2) along it;
     * the mean of both with a single division. */
    return clamp_r((m - t) * n / ((m + t) * (n + t * s2)), (real)(0.0f), (real)(1.0f));
}
inline Spectrum fresnel_conductor(real cos_i, Spectrum eta, Spectrum k)
{
    Spectrum f = spectrum_of(0.0f);
#define C(c) SPECTRUM_PUT(f, c, fresnel_metal(cos_i, SPECTRUM_AT(eta, c), SPECTRUM_AT(k, c)));
    SPECTRUM_IN_TURN(C)
#undef C
    return f;
}

/* Reflectance of a smooth boundary averaged over a cosine-weighted hemisphere of the outside:
 * Egan and Hilgeman 1973 for eta < 1, d'Eon and Irving 2011 for eta >= 1. */
inline real fresnel_diffuse(real eta)
{
    real x = 1.0f / eta;
    real denser = 0.919317f + x * (-3.4793f + x * (6.75335f + x * (-7.80989f + x * (4.98554f - x * 1.36881f))));
    real thinner = 0.6681f + 0.0636f * x + eta * (0.7099f - eta * 1.4399f);
    return sel(eta < 1.0f, thinner, denser);
}

/* Step thin_slab: a thin slab of a dielectric: the reflections between its two faces add up to 2 F / (1 + F) in each
 * polarisation, and unpolarised light to the mean of both; the rest passes undeviated (Stokes 1862; without
 * interference). */

inline real thin_slab(real c, real eta)
{
    real cos2_t = 1.0f - (1.0f - c * c) / (eta * eta);
    vec2 f = fresnel_polarised(c, sqrt_r(cos2_t), eta);
    real r = f.x / (1.0f + f.x) + f.y / (1.0f + f.y);
    r = sel((cos2_t <= 0.0f) | (c == 0.0f), (real)(1.0f), r);
    return sel(eta == 1.0f, (real)(0.0f), r);
}

/* What it reflects at the cosine c, of an index eta over that around. */
inline Spectrum thin_slab_reflected(real c, Spectrum eta)
{
    Spectrum r = spectrum_of(thin_slab(c, eta.x));
    if (any(spectrum_varies(eta))) {
#define C(c_) r.c_ = thin_slab(c, eta.c_);
        SPECTRUM_EACH(C)
#undef C
    }
    return r;
}

/* Its transmittance: the share `transmittance` of the light that it does not reflect. */
inline Spectrum thin_slab_passed(real c, Spectrum inside, Spectrum outside, Spectrum transmittance)
{
    Spectrum f = thin_slab_reflected(c, relative_index(inside, outside));
    return spectrum_mul(transmittance, spectrum_sub(spectrum_of(1.0f), f));
}
