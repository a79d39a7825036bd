/* Layers beside the picture: what the camera sees at a path's first surface and, for denoisers, at the first one that
 * is not a mirror or smooth glass, as dark and as coloured as what is before lets it through. */
#include "film/layers.cl"

#if LAYER_ALBEDO || LAYER_DENOISING_ALBEDO
/* What a surface reflects, as the film's sensor tells it; `before`: of what is before it. */
inline void layer_add_albedo(Scene scene, global uint *layers, mask m, integer pixel_index, int word,
                             Scattering scatter, Wavelengths lambdas, Spectrum before, real weight)
{
    Spectrum albedo = spectrum_mul(bsdf_albedo(scatter.bsdf), before);
    layer_add(scene, layers, m, pixel_index, word, scale3(film_value(scene, albedo, lambdas), weight));
}
#endif

/* Adds what the `met` paths see here. Returns the paths' state, which says whether denoisers have got theirs. */
inline integer layers_record(Scene scene, Slab path, uint at, global uint *layers, mask met, Vertex v,
                             Scattering scatter, integer state)
{
    mask wanted = layers_want(path, at, met), first = wanted & (v.depth == 0);
    integer pixel_index = load_path_pixel_index(path, at);
#if LAYER_FIRST
    if (any(first)) {
        real weight = layer_weight(path, at);
#if LAYER_ALBEDO
        Spectrum nothing_before = spectrum_of(1.0f);
        layer_add_albedo(scene, layers, first, pixel_index, LAYER_ALBEDO, scatter, v.lambdas, nothing_before, weight);
#endif
#if LAYER_SHADING_NORMAL
        layer_add(scene, layers, first, pixel_index, LAYER_SHADING_NORMAL, scale3(scatter.shading.frame.n, weight));
#endif
#if LAYER_GEOMETRIC_NORMAL
        layer_add(scene, layers, first, pixel_index, LAYER_GEOMETRIC_NORMAL, scale3(v.s.n, weight));
#endif
#if LAYER_DEPTH
        real t = v.t + path_null_distance(path, at);
        layer_add_long(scene, layers, first, pixel_index, LAYER_DEPTH, t * weight);
#endif
#if LAYER_POSITION
        layer_add_long(scene, layers, first, pixel_index, LAYER_POSITION, v.s.p.x * weight);
        layer_add_long(scene, layers, first, pixel_index, LAYER_POSITION + 3, v.s.p.y * weight);
        layer_add_long(scene, layers, first, pixel_index, LAYER_POSITION + 6, v.s.p.z * weight);
#endif
#if LAYER_UV
        layer_add_long(scene, layers, first, pixel_index, LAYER_UV, v.s.uv.x * weight);
        layer_add_long(scene, layers, first, pixel_index, LAYER_UV + 3, v.s.uv.y * weight);
#endif
    }
#endif
#if LAYER_DENOISING && !BSDF_DELTA
    mask seen = wanted & ((state & PATH_SEEN) == 0);
    if (any(seen)) {
        real weight = layer_weight(path, at);
#if LAYER_DENOISING_ALBEDO
        layer_add_albedo(scene, layers, seen, pixel_index, LAYER_DENOISING_ALBEDO, scatter, v.lambdas, v.beta, weight);
#endif
#if LAYER_DENOISING_NORMAL
        layer_add(scene, layers, seen, pixel_index, LAYER_DENOISING_NORMAL, scale3(scatter.shading.frame.n, weight));
#endif
        state |= sel_i(met, (integer)(PATH_SEEN), (integer)(0));
    }
#endif
    return state;
}
