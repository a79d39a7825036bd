/* Stands for lighting/rival_area.cl at a collision. */
#include "merging/media.cl"

/* 0 in a medium without photons. */
inline real rival_merging_area(Scene scene, integer pass, Vertex v)
{
    mask merges = MATERIAL_KIND(merging_phase(scene, v.media.medium)) == (integer)(BSDF_KIND);
    return sel(merges, merging_area_along(scene, pass) / scene.settings->rival_area, (real)(0.0f));
}
