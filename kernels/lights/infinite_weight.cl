/* What light of an infinite light counts, against its choice by next-event estimation and against light paths. */
#include "generated/rival_dull.cl"

inline real infinite_weight(Scene scene, int row, vec3 p, vec3 d, real pdf, real other, real rival)
{
    real emission = light_path_pdf(scene, (integer)(row), p, d, (real)(FAR), neg3(d));
    return mis_weight_of_three(pdf, other, rival_of_dull(rival * emission, pdf));
}

/* Twin, where paths are not weighed against light paths. */
#define infinite_weight(scene, row, p, d, pdf, other, rival) \
    sel((pdf) < 0.0f, (real)(1.0f), mis_weight(pdf, other))
