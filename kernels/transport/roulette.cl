/* Russian roulette by the throughput ratio. A path with a third of its light continues, but for a chance that ends
 * paths between surfaces that absorb nothing. Media have no such chance, as paths there have hundreds of collisions:
 * survivors would be few and bright. The numbers were measured: bench/notes/samplers.md. */
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
