/* The transmittance of a coat of a DiffuseLobe (materials/bsdf.cl), as plastics have it. */
#include "materials/fresnel.cl"
#include "materials/microfacet.cl"
#include "materials/rough_coat.cl"

/* cos_i > 0 */
inline real coat_passes(real cos_i, real eta, real alpha)
{
    mask coated = eta > 0.0f;
    eta = sel(coated, eta, (real)(1.5f));
    real smooth = 1.0f - fresnel_dielectric(cos_i, eta).f, rough = smooth;
    if (any(coated & (alpha != 0.0f))) {
        integer beckmann = sel_i(alpha < 0.0f, (integer)(1), (integer)(0));
        rough = coat_transmittance(microfacets_of(beckmann, fabs(alpha), fabs(alpha)), cos_i, eta);
    }
    return sel(coated, sel(alpha != 0.0f, rough, smooth), (real)(1.0f));
}
