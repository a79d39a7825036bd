/* What a path does with a guide at a vertex. */

/* What the guide knows where a camera's path is. */
typedef struct {
    integer row;
    real light; /* all that has come there; 0: nothing is known */
    real even;  /* light from everywhere that is expected beside it, over it */
} Guided;

/* Step. */
#include "transport/guiding/guide.cl"

/* Two pairs of numbers for each vertex, beyond those of transport/path_state.cl: a direction; which one is taken. */
#define DIMENSION_GUIDE 0x40000

/* Density of a direction by guide and material together, which alone has the density p [1/sr]. */
inline real guided_pdf(Guided guided, vec3 d, real p MERGE_ARGS) { return guide_pdf(guide, guided, d, p); }

/* The next direction, of the guide or of the material. */
inline BsdfSample onward_sample(Scattering scatter, Guided guided, Spectrum *ratio MERGE_ARGS)
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
inline Guided guide_at(Scene scene, Surface s, vec3 d MERGE_ARGS) { Guided g = {0, 0.0f, 0.0f}; return g; }
inline real guided_pdf(Guided guided, vec3 d, real p MERGE_ARGS) { return p; }
inline mask guided_plays(Slab path, uint at, Guided guided, Spectrum beta, Scattering scatter, mask *next,
                         Spectrum *after) { return mask_of(0); }
inline BsdfSample onward_sample(Scattering scatter, Guided guided, Spectrum *ratio MERGE_ARGS)
{
    vec2 uv = sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_BSDF);
    return hero_sample(scatter.bsdf, scatter.wo, v3(uv.x, uv.y, scatter.choice.y), ratio);
}
