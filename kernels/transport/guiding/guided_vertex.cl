/* A vertex of a path with path guiding. */

/* The row of the guide at a vertex. */
typedef struct {
    integer row;
    real light; /* all light of the row; 0: the row is empty */
    real even;  /* uniform light that is expected in addition, over `light` */
} Guided;

/* Step. */
#include "transport/guiding/guide.cl"

/* Two pairs of numbers for each vertex, beyond those of transport/path_state.cl: a direction; the selection of a
 * candidate. */
#define DIMENSION_GUIDE 0x40000

/* Density of a direction by guide and material together, where the material alone has the density p [1/sr]. */
inline real guided_pdf(Guided guided, vec3 d, real p MERGE_ARGS) { return guide_pdf(guide, guided, d, p); }

/* Samples the next direction by guide and material. */
inline BsdfSample onward_sample(Scattering scatter, Guided guided, Spectrum *ratio MERGE_ARGS)
{
    vec2 uv = sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_BSDF);
    /* The hero wavelength must not depend on the other candidate, so the random numbers differ. */
    vec2 toward = BSDF_CHROMATIC ? sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_GUIDE) : uv;
    real chance = sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_GUIDE + 1).x;
    vec3 u = v3(uv.x, uv.y, scatter.choice.y);
    BsdfSample s =
        guide_sample(guide, guided, scatter.bsdf, scatter.shading.frame, scatter.wo, u, toward, chance, ratio);
    pair_of_sample(scatter.bsdf, scatter.wo, &s);
    return s;
}

/* Russian roulette by the guide, see guide_roulette; beta: throughput of the incident ray. */
inline mask guided_plays(Slab path, uint at, Guided guided, Spectrum beta, Scattering scatter, mask *next,
                         Spectrum *after)
{
    real brings = spectrum_max(spectrum_mul(beta, bsdf_albedo(scatter.bsdf)));
    real chance = sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_ROULETTE).x;
    return guide_roulette(path, at, guided, brings, chance, next, after);
}

/* Twin, where the material alone samples directions. */
inline Guided guide_at(Scene scene, Surface s, vec3 d MERGE_ARGS) { Guided g = {0, 0.0f, 0.0f}; return g; }
inline real guided_pdf(Guided guided, vec3 d, real p MERGE_ARGS) { return p; }
inline mask guided_plays(Slab path, uint at, Guided guided, Spectrum beta, Scattering scatter, mask *next,
                         Spectrum *after) { return mask_of(0); }
inline BsdfSample onward_sample(Scattering scatter, Guided guided, Spectrum *ratio MERGE_ARGS)
{
    vec2 uv = sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_BSDF);
    return hero_sample(scatter.bsdf, scatter.wo, v3(uv.x, uv.y, scatter.choice.y), ratio);
}
