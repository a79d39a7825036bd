/* What light of an infinite light counts, against its choice by next-event estimation and against light paths. */
#include "generated/diffuse_roulette.cl"

inline real infinite_weight(Scene scene, int row, vec3 p, vec3 d, real pdf, real other, real mis_ratio)
{
    real emission = light_path_pdf(scene, (integer)(row), p, d, (real)(FAR), neg3(d));
    return mis_weight_of_three(pdf, other, after_diffuse_roulette(mis_ratio * emission, pdf));
}

/* Twin, where paths are not weighed against light paths. */
inline real infinite_weight(Scene scene, int row, vec3 p, vec3 d, real pdf, real other, real mis_ratio)
{
    return sel(pdf < 0.0f, (real)(1.0f), mis_weight(pdf, other));
}
