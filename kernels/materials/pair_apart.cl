/* Stands for materials/pair.cl where a material's functions are a part of their own, see
 * materials/material_apart.cl. */
#define bsdf_pair(m, wo, wi, ratio) ((m).answer.pair)
#define bsdf_sample(m, wo, u) ((m).answer.sample)
#define pair_of_sample(m, wo, s)
#define bsdf_ask(scene, scatter, wi, adjoint) (scatter).bsdf.answer = apart_asked(scene, scatter, wi, adjoint)

inline BsdfAnswer apart_asked(Scene scene, Scattering scatter, vec3 wi, uint adjoint)
{
    vec2 uv = sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_BSDF);
    vec3 u = v3(uv.x, uv.y, scatter.choice.y);
    Bsdf m = scatter.bsdf;
    return apart_answer(scene, m.row, m.point, m.lambdas, scatter.wo, wi, u, adjoint);
}
