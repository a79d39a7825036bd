/* A thin slab of a dielectric: the reflections between its two faces add up to 2 F / (1 + F) in each polarisation, and
 * unpolarised light to the mean of both; the rest passes undeviated (Stokes 1862; without interference). */
#include "materials/fresnel.cl"

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
