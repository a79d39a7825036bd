/* In place of transport/mis_merging_area.cl, at a collision. */
#include "transport/photons/media.cl"

/* 0 in a medium without photons. */
inline real mis_merging_area(Scene scene, integer pass, Vertex v)
{
    mask merges = MATERIAL_KIND(merging_phase(scene, v.media.medium)) == (integer)(BSDF_KIND);
    Medium m = medium_load(scene, sel_i(merges, v.media.medium, (integer)(0)), v.lambdas);
    real area = merging_area_along(scene, pass, m.sigma_t) / scene.settings->mis_area_unit;
    return sel(merges, area, (real)(0.0f));
}
