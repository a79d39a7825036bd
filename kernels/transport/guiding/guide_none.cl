/* Stands for transport/guiding/guide.cl where the material alone chooses directions. */
typedef integer Guided;
#define guide_at(scene, guide, s, d) ((integer)(0))
#define guided_pdf(guide, guided, d, p) (p)
#define guided_plays(path, at, guided, beta, scatter, next, after) mask_of(0)
#define onward_sample(scatter, guide, guided, ratio) \
    direction_sample(scatter, sampler_pair((scatter).sampler, (scatter).dimension + DIMENSION_BSDF), ratio)

/* The next direction, of the material. */
inline BsdfSample direction_sample(Scattering scatter, vec2 uv, Spectrum *ratio)
{
    return hero_sample(scatter.bsdf, scatter.wo, v3(uv.x, uv.y, scatter.choice.y), ratio);
}
