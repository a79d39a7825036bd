/* Layers beside the picture: what the camera sees at a path's first surface and, for denoisers, at the first one that
 * is not a mirror or smooth glass, as dark and as coloured as what is before lets it through. */
#include "film/layers.cl"

#include "generated/mattes.cl"
#define DENOISERS_SEE (LAYER_DENOISING && !BSDF_DELTA) /* past mirrors and smooth glass */

/* What a surface reflects, as the film's sensor tells it; `before`: of what is before it. */
inline vec3 layer_albedo(Scene scene, Scattering scatter, Wavelengths lambdas, Spectrum before, real weight)
{
    Spectrum albedo = spectrum_mul(bsdf_albedo(scatter.bsdf), before);
    return scale3(film_value(scene, albedo, lambdas), weight);
}

/* How far a point is from the camera along its axis, the third column of `to_world` [m]. */
inline real layer_z(Scene scene, vec3 p)
{
    global const float *m = (global const float *)scene.camera;
    float length = sqrt(m[2] * m[2] + m[6] * m[6] + m[10] * m[10]);
    return ((p.x - m[3]) * m[2] + (p.y - m[7]) * m[6] + (p.z - m[11]) * m[10]) / length;
}

/* The shading normal; points of media have none. */
inline vec3 layer_normal(Scattering scatter)
{
    return BSDF_IS_PHASE ? v3(0.0f, 0.0f, 0.0f) : scatter.shading.frame.n;
}

/* Puts three numbers of any size. */
inline void layer_put_long3(integer *words, mask m, vec3 v, real weight)
{
    layer_put_long(words, m, v.x * weight);
    layer_put_long(words + 3, m, v.y * weight);
    layer_put_long(words + 6, m, v.z * weight);
}

/* Puts what the camera sees `first`; LAYER_<NAME> is 0 where there is no such layer. */
inline void layers_put_first(Scene scene, Slab path, uint at, integer *words, mask first, Vertex v, Scattering scatter,
                             real weight)
{
    words[0] = sel_i(first, (integer)(1), (integer)(0));
    if (LAYER_ALBEDO) {
        vec3 albedo = layer_albedo(scene, scatter, v.lambdas, spectrum_of(1.0f), weight);
        layer_put(words + LAYER_ALBEDO, first, albedo);
    }
    if (LAYER_SHADING_NORMAL) layer_put(words + LAYER_SHADING_NORMAL, first, scale3(layer_normal(scatter), weight));
    if (LAYER_GEOMETRIC_NORMAL) layer_put(words + LAYER_GEOMETRIC_NORMAL, first, scale3(v.s.n, weight));
    if (LAYER_DEPTH)
        layer_put_long(words + LAYER_DEPTH, first, (v.t + load_path_null_distance(path, at)) * weight);
    if (LAYER_Z) layer_put_long(words + LAYER_Z, first, layer_z(scene, v.s.p) * weight);
    if (LAYER_POSITION) layer_put_long3(words + LAYER_POSITION, first, v.s.p, weight);
    if (LAYER_UV) {
        layer_put_long(words + LAYER_UV, first, v.s.uv.x * weight);
        layer_put_long(words + LAYER_UV + 3, first, v.s.uv.y * weight);
    }
    if (LAYER_MOTION) screen_motion_record(scene, words + LAYER_MOTION, first, v, weight);
    mask zeroth = first & (load_path_sample(path, at) == 0);
    if (LAYER_SHAPE_ID) layer_put_id(words + LAYER_SHAPE_ID, zeroth, v.object);
    if (LAYER_PRIMITIVE_ID) layer_put_id(words + LAYER_PRIMITIVE_ID, zeroth, v.primitive);
    if (LAYER_MATERIAL_ID) layer_put_id(words + LAYER_MATERIAL_ID, zeroth, v.material);
}

/* Adds what the `met` paths see here. Returns the paths' state, which says whether denoisers have got theirs. */
inline integer layers_record(Scene scene, Slab path, uint at, LAYER_ARGS, mask met, Vertex v, Scattering scatter,
                             integer state)
{
    mask wanted = layers_want(path, at, met), first = wanted & (v.depth == 0), adds = first;
    if (DENOISERS_SEE) { /* those that are here first are among them */
        adds = wanted & ((state & PATH_SEEN) == 0);
        state |= sel_i(met, (integer)(PATH_SEEN), (integer)(0));
    }
    if (!any(adds)) return state;
    real weight = layer_weight(path, at);
    integer words[PIXEL_LAYER_WORDS];
    layers_put_first(scene, path, at, words, first, v, scatter, weight);
    if (DENOISERS_SEE * LAYER_DENOISING_ALBEDO) {
        vec3 albedo = layer_albedo(scene, scatter, v.lambdas, v.beta, weight);
        layer_put(words + LAYER_DENOISING_ALBEDO, adds, albedo);
    }
    if (DENOISERS_SEE * LAYER_DENOISING_NORMAL)
        layer_put(words + LAYER_DENOISING_NORMAL, adds, scale3(layer_normal(scatter), weight));
    int count = LAYER_DENOISING && BSDF_DELTA ? LAYER_DENOISING : PIXEL_LAYER_WORDS; /* theirs come last */
    integer pixel_index = load_path_pixel_index(path, at);
    layers_add(scene, layers, adds, pixel_index, words, count);
    mattes_record(mattes, first, pixel_index, v);
    return state;
}
