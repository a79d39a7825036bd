/* Russian roulette at a vertex: returns the paths of `next` that go on, and scales their throughput. */
#include "transport/roulette.cl"

/* Step path: for paths from the camera. */
inline mask path_roulette(Scene scene, Slab path, uint at, mask next, mask null, Vertex v, Scattering scatter,
                          Guided guided, real eta, Spectrum *beta)
{
    mask play = !null & (v.depth + 1 >= scene.settings->rr_depth) & !reuse_begins(scene, v);
    real strength = spectrum_max(*beta);
    next = next & (strength > 0.0f);
    play = play & !guided_plays(path, at, guided, v.beta, scatter, &next, beta);
    if (any(next & play)) {
        vec2 u = sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_ROULETTE);
        next = roulette(next, play, strength * eta * eta, u.x, beta);
    }
    return next;
}

/* Twin, at null surfaces, where nothing is lost. */
inline mask path_roulette(Scene scene, Slab path, uint at, mask next, mask null, Vertex v, Scattering scatter,
                          Guided guided, real eta, Spectrum *beta) { return next; }

/* Step light_path: for light paths, by the share of the light's power that is left. */
inline mask light_path_roulette(Scene scene, Slab path, uint at, mask next, mask null, Vertex v, Scattering scatter,
                                Spectrum *beta)
{
    mask play = !null & (v.depth >= scene.settings->rr_depth);
    real strength = spectrum_max(*beta) * load_path_weight(path, at);
    next = next & (strength > 0.0f);
    if (any(next & play)) {
        vec2 u = sampler_pair(scatter.sampler, scatter.dimension + DIMENSION_ROULETTE);
        next = roulette(next, play, strength, u.x, beta);
    }
    return next;
}

/* Twin, at null surfaces, where nothing is lost. */
inline mask light_path_roulette(Scene scene, Slab path, uint at, mask next, mask null, Vertex v, Scattering scatter,
                                Spectrum *beta) { return next; }

/* Step diffuse: for light paths at a diffuse first surface (transport/roulette.cl). */
inline mask dull_goes_on(mask next, mask null, Scattering scatter, BsdfSample bs, MisRatio *r, Spectrum *beta)
{
    mask plays = next & r->first & !null & ((bs.lobe & LOBE_DELTA) == 0) & is_diffuse_pdf(bs.p_back);
    if (any(plays)) { /* no light is chosen here: DIMENSION_CHOICE is unused */
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
