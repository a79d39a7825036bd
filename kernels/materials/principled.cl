/* What the principled materials share (Burley 2012 and 2015, in Mitsuba 3's reading of them). */
#include "materials/fresnel.cl"
#include "core/luminance.cl"
#include "materials/microfacet.cl"

/* Microfacets of roughness^2, stretched along the tangent (Burley 2012, 5.4). */
inline Microfacets principled_facets(real roughness, real anisotropic)
{
    real aspect = sqrt_r(1.0f - 0.9f * anisotropic), a = sqr(roughness);
    return microfacets_of((integer)(0), max_r(a / max_r(aspect, (real)(0.1f)), (real)(1e-3f)),
                          max_r(a * aspect, (real)(1e-3f)));
}

inline real schlick_weight(real c) /* (1 - c)^5 */
{
    real m = clamp_r(1.0f - c, (real)(0.0f), (real)(1.0f));
    return sqr(sqr(m)) * m;
}

/* Schlick's weight at the boundary to index eta: of the angle on the thinner side. */
inline real schlick_boundary(real cos_i, real eta)
{
    real refracted = sqrt_r(1.0f - (1.0f - sqr(cos_i)) / sqr(eta));
    return schlick_weight(sel(eta > 1.0f, fabs(cos_i), refracted));
}
inline Spectrum schlick_boundary_spectrum(real cos_i, Spectrum eta)
{
    Spectrum weight = spectrum_of(schlick_boundary(cos_i, eta.x));
    if (any(spectrum_varies(eta))) {
#define C(c) weight.c = schlick_boundary(cos_i, eta.c);
        SPECTRUM_EACH(C)
#undef C
    }
    return weight;
}
inline Spectrum schlick_spectrum(Spectrum at_normal, Spectrum weight)
{
    Spectrum r;
#define C(c) r.c = at_normal.c + (1.0f - at_normal.c) * weight.c;
    SPECTRUM_EACH(C)
#undef C
    return r;
}

/* Colour without brightness; white where there is none. */
inline Spectrum principled_tint(Spectrum colour, real luminance)
{
    mask lit = luminance > 0.0f;
    return spectrum_sel(lit, spectrum_scale(colour, 1.0f / sel(lit, luminance, (real)(1.0f))), spectrum_of(1.0f));
}

/* A dielectric's Fresnel reflection f, the share `amount` of it by Schlick and tinted. */
inline Spectrum principled_fresnel(Spectrum f, Spectrum eta, Spectrum weight, Spectrum tint, real amount)
{
    if (any(amount > 0.0f)) {
        Spectrum at_normal;
#define C(c) at_normal.c = tint.c * sqr((eta.c - 1.0f) / (eta.c + 1.0f));
        SPECTRUM_EACH(C)
#undef C
        f = spectrum_madd(schlick_spectrum(at_normal, weight), amount, spectrum_scale(f, 1.0f - amount));
    }
    return f;
}

/* Diffuse reflection with retro-reflection at grazing angles, times pi over the colour (Burley 2015
 * eq. 4), and its blend with the flat subsurface look (Burley 2012, 5.3); c: of half vector and wi. */
inline real principled_diffuse(real cos_o, real cos_i, real c, real roughness, real flatness)
{
    real o = schlick_weight(cos_o), i = schlick_weight(cos_i), r = 2.0f * roughness * sqr(c);
    real diffuse = (1.0f - 0.5f * o) * (1.0f - 0.5f * i) + r * (o + i + o * i * (r - 1.0f));
    if (any(flatness > 0.0f)) {
        real half_r = 0.5f * r, flat = (1.0f + (half_r - 1.0f) * o) * (1.0f + (half_r - 1.0f) * i);
        flat = 1.25f * (flat * (1.0f / max_r(cos_o + cos_i, (real)(1e-6f)) - 0.5f) + 0.5f);
        diffuse += flatness * (flat - diffuse);
    }
    return diffuse;
}

/* Sheen (Burley 2012, 5.5), white or tinted. */
inline Spectrum principled_sheen(Spectrum tint, real amount, real c)
{
    Spectrum white = spectrum_of(1.0f);
    return spectrum_scale(spectrum_madd(spectrum_sub(tint, white), amount, white), schlick_weight(fabs(c)));
}
