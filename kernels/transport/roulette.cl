/* Russian roulette: the chance that a path goes on, by its throughput over what it began with. Where paths end only by
 * chance (1 after surfaces that absorb nothing), a little less than 1 brings them to an end; a path that still has a
 * third of its light is worth its time. In media that is not so: a path there has hundreds of collisions before it
 * comes out, and those that chance had left would be few and bright. All numbers were measured:
 * bench/notes/samplers.md. */
#define ROULETTE_FREE (BSDF_IS_PHASE ? 1.5f : 3.0f)
#define ROULETTE_MOST (BSDF_IS_PHASE ? 1.0f : 0.98f)

inline real roulette_chance(real strength) { return min_r(ROULETTE_FREE * strength, (real)(ROULETTE_MOST)); }

/* Which of the `next` paths go on: those that do not `play`, and the winners, whose throughput makes up for the
 * others. strength: of the throughput, over what it began with; u: uniform in [0, 1). */
inline mask roulette(mask next, mask play, real strength, real u, Spectrum *beta)
{
    real q = roulette_chance(strength);
    next = next & (!play | (u < q));
    *beta = spectrum_scale(*beta, sel(play, 1.0f / max_r(q, (real)(1e-6f)), (real)(1.0f)));
    return next;
}
