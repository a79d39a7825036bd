/* Russian roulette by the throughput ratio. A path with a third of its light continues, but for a chance that ends
 * paths between surfaces that absorb nothing. Media have no such chance, as paths there have hundreds of collisions:
 * survivors would be few and bright. The numbers were measured: bench/notes/samplers.md. */

/* Step. */
#define ROULETTE_FREE (BSDF_IS_PHASE ? 1.5f : 3.0f)
#define ROULETTE_MOST (BSDF_IS_PHASE ? 1.0f : 0.98f)

inline real roulette_chance(real strength) { return min_r(ROULETTE_FREE * strength, (real)(ROULETTE_MOST)); }

/* Returns the paths that continue, with the throughput of winners raised. strength: throughput ratio; u: in [0, 1). */
inline mask roulette(mask next, mask play, real strength, real u, Spectrum *beta)
{
    real q = roulette_chance(strength);
    next = next & (!play | (u < q));
    *beta = spectrum_scale(*beta, sel(play, 1.0f / max_r(q, (real)(1e-6f)), (real)(1.0f)));
    return next;
}

/* Step diffuse: Russian roulette of light paths at a first diffuse surface, in scenes with aimed light paths: see
 * transport/mis_ratio.cl.
 *
 * Next-event estimation of the camera's paths finds the light of a diffuse surface well. So an eighth of such light
 * paths continues (integrator/steps/roulette.cl), and the density of light paths is an eighth if the last surface
 * before the light is diffuse. Both sides decide by p, the density of the direction to the light for a camera's path
 * [1/sr]; below 0 is a delta lobe. */
#define DIFFUSE_PDF 1.0f /* an even hemisphere has 0.16, a metal of roughness 0.2 has 2 */
#define DIFFUSE_SHARE 0.125f

inline mask is_diffuse_pdf(real p) { return (p >= 0.0f) & (p <= DIFFUSE_PDF); }

/* The density ratio of light paths with the roulette; p: at the last surface before the light. */
inline real after_diffuse_roulette(real third, real p)
{
    return third * sel(is_diffuse_pdf(p), (real)(DIFFUSE_SHARE), (real)(1.0f));
}

/* Twin, where all light paths continue from diffuse surfaces. */
inline real after_diffuse_roulette(real third, real p) { return third; }
