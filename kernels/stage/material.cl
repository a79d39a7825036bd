/* The functions of a kind of material, as a part of the loop (stage/loop.cl) for a vertex that several kinds share:
 * materials/bsdf.cl. */
#include "stage/stage.cl"
#include "shapes/shape.cl"
#include "lights/light.cl"
#include "generated/textures.cl"
#include "materials/fresnel.cl"
#include "materials/microfacet.cl"
#include "materials/bsdf.cl"
#include "generated/bsdf.cl"
#include "generated/hero_steps.cl"
#include "materials/bsdf.cl#pair"
#include "generated/bsdf_answer.cl"

/* The answer to a vertex, of LANES paths. */
inline BsdfAnswer material_answer(Bsdf m, vec3 wo, vec3 wi, vec3 u, int adjoint)
{
    BsdfAnswer a;
    Spectrum every = spectrum_of(1.0f);
    a.sample = bsdf_sample(m, wo, u);
    pair_of_sample(m, wo, &a.sample);
    if (adjoint) a.pair = bsdf_pair(m, wi, wo, every);
    else a.pair = bsdf_pair(m, wo, wi, every);
    answer_diffuse_lobe(a, m, wo);
    return a;
}

#include "generated/material_part.cl"
