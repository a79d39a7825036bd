/* Russian roulette of light paths at a diffuse first surface (transport/roulette.cl): returns the paths of
 * `next` that continue, and scales their throughput. */
inline mask dull_goes_on(mask next, mask null, Scattering scatter, BsdfSample bs, MisRatio *r, Spectrum *beta)
{
    mask plays = next & r->first & !null & ((bs.lobe & LOBE_DELTA) == 0) & is_diffuse_pdf(bs.p_back);
    if (any(plays)) { /* no light is chosen here, so that number is free */
        vec2 u = sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_CHOICE);
        real gain = sel(plays, (real)(1.0f / DIFFUSE_SHARE), (real)(1.0f));
        r->arrives *= gain;
        *beta = spectrum_scale(*beta, gain);
        next = next & (!plays | (u.x < DIFFUSE_SHARE));
    }
    return next;
}

/* Twin, where no first surface plays. */
inline mask dull_goes_on(mask next, mask null, Scattering scatter, BsdfSample bs, MisRatio *r, Spectrum *beta)
{
    return next;
}
