/* Roulette of light paths at their first surface, where it is dull (transport/rival_dull.cl): which of the `next` ones
 * go on, and with what throughput. */
inline mask dull_goes_on(mask next, mask null, Scattering scatter, BsdfSample bs, Rival *r, Spectrum *beta)
{
    mask plays = next & r->first & !null & ((bs.lobe & LOBE_DELTA) == 0) & is_dull(bs.p_back);
    if (any(plays)) { /* no light is chosen here, so that number is free */
        vec2 u = sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_CHOICE);
        real gain = sel(plays, (real)(1.0f / DULL_SHARE), (real)(1.0f));
        r->arrives *= gain;
        *beta = spectrum_scale(*beta, gain);
        next = next & (!plays | (u.x < DULL_SHARE));
    }
    return next;
}

/* Twin, where no first surface plays. */
#define dull_goes_on(next, null, scatter, bs, rival, beta) (next)
