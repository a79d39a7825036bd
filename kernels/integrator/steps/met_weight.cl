/* What light that a path meets counts, against its choice by next-event estimation and against light paths. */
#include "generated/diffuse_roulette.cl"

inline real met_weight(Scene scene, Slab path, uint at, Vertex v, integer light, real pdf, real other)
{
    real emission = light_path_pdf(scene, light, v.o, v.d, v.t, v.s.n);
    return mis_weight_of_three(pdf, other, after_diffuse_roulette(path_mis_ratio(path, at, v.depth) * emission, pdf));
}

/* Twin, where paths are not weighed against light paths. */
inline real met_weight(Scene scene, Slab path, uint at, Vertex v, integer light, real pdf, real other)
{
    return sel(pdf < 0.0f, (real)(1.0f), mis_weight(pdf, other));
}
