/* Russian roulette for a light path, on what is left of what the light gave: which of the `next` paths go on. */
#include "transport/roulette.cl"

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
