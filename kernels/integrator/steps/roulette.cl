/* Russian roulette at a vertex: which of the `next` paths go on, and with what throughput. */
#include "transport/roulette.cl"

inline mask path_roulette(Scene scene, Slab path, uint at, mask next, mask null, Vertex v, Scattering scatter,
                          Guided guided, real eta, Spectrum *beta)
{
    mask play = !null & (v.depth + 1 >= scene.settings->rr_depth);
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
