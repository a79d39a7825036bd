/* What a boundary does with light where no material of the kind has layers: Fresnel's equations alone.
 * The same functions stand in materials/boundary_film.cl and materials/boundary_table.cl. */
#include "materials/fresnel.cl"
#include "materials/boundary.cl"

typedef struct { int none; } Layers;

inline Layers layers_none(void) { Layers l = {0}; return l; }

/* Two dielectrics, at cosine cos_i, signed; eta: index of the inside over the outside. */
inline Boundary dielectric_boundary(Layers layers, real cos_i, Spectrum eta, Spectrum outside)
{
    Boundary b;
    b.r = fresnel_spectrum(cos_i, eta);
    b.t = spectrum_sub(spectrum_of(1.0f), b.r);
    b.p = spectrum_mean(b.r);
    return b;
}
/* The same with a common index for all wavelengths, which meet a facet at the same cosine. */
inline Boundary facet_boundary(Layers layers, real cos_i, real eta, Spectrum outside)
{
    Boundary b;
    b.p = fresnel_dielectric(cos_i, eta).f;
    b.r = spectrum_of(b.p);
    b.t = spectrum_of(1.0f - b.p);
    return b;
}
/* A metal's reflectance seen from vacuum, cos_i >= 0. */
inline Spectrum conductor_boundary(Layers layers, real cos_i, Spectrum eta, Spectrum k)
{
    return fresnel_conductor(cos_i, eta, k);
}
