/* What a path does with a guide at a vertex. */
#include "transport/guiding/guide.cl"

/* Two pairs of numbers for each vertex, beyond those of transport/path_state.cl: a direction; which one is taken. */
#define DIMENSION_GUIDE 0x40000

#define guided_pdf(guide, guided, d, p) guide_pdf(guide, guided, d, p)

/* The next direction, of the guide or of the material. */
inline BsdfSample onward_sample(Scattering scatter, global const uint *guide, Guided guided, Spectrum *ratio)
{
    vec2 uv = sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_BSDF);
    /* Which wavelength leads must not follow from the other direction, so the numbers are others. */
    vec2 toward = BSDF_CHROMATIC ? sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_GUIDE) : uv;
    real chance = sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_GUIDE + 1).x;
    vec3 u = v3(uv.x, uv.y, scatter.choice.y);
    BsdfSample s =
        guide_sample(guide, guided, scatter.bsdf, scatter.shading.frame, scatter.wo, u, toward, chance, ratio);
    pair_of_sample(scatter.bsdf, scatter.wo, &s);
    return s;
}

/* Russian roulette by what a guide knows, see guide_roulette; beta: of the ray that arrives. */
inline mask guided_plays(Slab path, uint at, Guided guided, Spectrum beta, Scattering scatter, mask *next,
                         Spectrum *after)
{
    real brings = spectrum_max(spectrum_mul(beta, bsdf_albedo(scatter.bsdf)));
    real chance = sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_ROULETTE).x;
    return guide_roulette(path, at, guided, brings, chance, next, after);
}

/* Twin, where the material alone chooses directions. */
typedef integer Guided;
#define guide_at(scene, guide, s, d) ((integer)(0))
#define guided_pdf(guide, guided, d, p) (p)
#define guided_plays(path, at, guided, beta, scatter, next, after) mask_of(0)
#define onward_sample(scatter, guide, guided, ratio) \
    direction_sample(scatter, sampler_pair((scatter).sampler, (scatter).dimension + DIMENSION_BSDF), ratio)

inline BsdfSample direction_sample(Scattering scatter, vec2 uv, Spectrum *ratio)
{
    return hero_sample(scatter.bsdf, scatter.wo, v3(uv.x, uv.y, scatter.choice.y), ratio);
}
