/* What rough dielectric facets of GGX reflect of light from outside, without light that meets several: the mean of F G1
 * over the normals that are seen, from a table; eta: index behind them over that before. Within 0.006 of float64 sums
 * from an index of 1 on; below, as if they were smooth at a cosine that stands for theirs. d: equally rough in all
 * directions. */
#include "materials/coat_cell.cl"
#include "generated/facet_reflectance_table.cl"

inline real facet_reflectance(Microfacets d, real cos_i, real eta)
{
    CoatCell cell = coat_cell(d, eta);
    real c2 = cos_i * cos_i, facing = sqrt(c2 + sqr(d.alpha_u) * max_r(1.0f - c2, (real)(0.0f)));
    real x = (1.0f - sqrt_r(1.0f - cos_i / max_r(facing, (real)(1e-6f)))) * (float)(COAT_COSINES - 1);
    integer k = clamp_i(to_integer(x), (integer)(COAT_COSINES - 2));
    real more = FACET_TURNED_UNIT * coat_look_up_by(facet_turned, COAT_COSINES, cell, k, x - to_real(k)) - 1.0f;
    return clamp_r(fresnel_dielectric(facing, eta).f + more, (real)(0.0f), (real)(1.0f));
}
/* Of diffuse light. */
inline real facet_reflectance_mean(Microfacets d, real eta)
{
    real mean = FACET_TURNED_MEAN_UNIT * coat_look_up(facet_turned_mean, coat_cell(d, eta));
    return sel(eta < 1.0f, fresnel_diffuse(eta), mean);
}
