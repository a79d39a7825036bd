/* What a boundary with thin films does with light, wave by wave: spectral mode. The generated text
 * before this has the structs Layer and Layers, and layer_at. */
#include "materials/fresnel.cl"
#include "materials/boundary.cl"
#include "materials/thin_film.cl"

inline Boundary dielectric_boundary(Layers layers, real cos_i, Spectrum eta, Spectrum outside)
{
    mask outward = cos_i < 0.0f;
    Spectrum inside = spectrum_mul(eta, outside);
    Spectrum from = spectrum_sel(outward, inside, outside), to = spectrum_sel(outward, outside, inside);
    Boundary b = thin_film(layers, outward, cos_i, from, to, spectrum_of(0.0f));
    b.p = sel(layers.count > 0, reflection_probability(b.r, b.t), spectrum_mean(b.r));
    return b;
}
inline Boundary facet_boundary(Layers layers, real cos_i, real eta, Spectrum outside)
{
    return dielectric_boundary(layers, cos_i, spectrum_of(eta), outside);
}
inline Spectrum conductor_boundary(Layers layers, real cos_i, Spectrum eta, Spectrum k)
{
    return thin_film(layers, mask_of(0), cos_i, spectrum_of(1.0f), eta, k).r;
}
