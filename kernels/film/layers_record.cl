/* Layers beside the picture: what the camera sees at a path's first surface and, for denoisers, at the first one that
 * is not a mirror or smooth glass, as dark and as coloured as what is before lets it through. */
#include "film/layers.cl"
#include "generated/scouts.cl"

#include "generated/mattes.cl"
#define DENOISERS_SEE (settings->layer_denoising && !BSDF_DELTA) /* past mirrors and smooth glass */

/* What a surface reflects, as the film's sensor tells it; `before`: of what is before it. */
inline vec3 layer_albedo(Scene scene, Scattering scatter, Wavelengths lambdas, Spectrum before, real weight)
{
    Spectrum albedo = spectrum_mul(bsdf_albedo_in(scene, scatter.bsdf), before);
    return scale3(film_value(scene, albedo, lambdas), weight);
}

/* How far a point is from the camera along its axis, the third column of `to_world` at the path's time [m]. */
inline real layer_z(Scene scene, vec3 p)
{
    global const float *m = (global const float *)scene.camera;
    vec3 axis = v3(m[2], m[6], m[10]), from = v3(m[3], m[7], m[11]);
    camera_axis_moved(scene, &from, &axis);
    return dot3(sub3(p, from), axis) / sqrt(dot3(axis, axis));
}

/* The shading normal; points of media have none. */
inline vec3 layer_normal(Scattering scatter) { return BSDF_IS_PHASE ? v3(0.0f, 0.0f, 0.0f) : scatter.shading.frame.n; }

/* Puts three numbers of any size. */
inline void layer_put_long3(integer *words, mask m, vec3 v, real weight)
{
    layer_put_long(words, m, v.x * weight);
    layer_put_long(words + LAYER_LONG_WORDS, m, v.y * weight);
    layer_put_long(words + 2 * LAYER_LONG_WORDS, m, v.z * weight);
}

/* Puts what the camera sees `first`; Settings.layer_<name> is 0 where there is no such layer. */
inline void layers_put_first(Scene scene, Slab path, uint at, integer *words, mask first, Vertex v, Scattering scatter,
                             real weight)
{
    global const Settings *settings = scene.settings;
    words[0] = sel_i(first, (integer)(1), (integer)(0));
    if (settings->layer_albedo) {
        vec3 albedo = layer_albedo(scene, scatter, v.lambdas, spectrum_of(1.0f), weight);
        layer_put(words + settings->layer_albedo, first, albedo);
    }
    if (settings->layer_shading_normal)
        layer_put(words + settings->layer_shading_normal, first, scale3(layer_normal(scatter), weight));
    if (settings->layer_geometric_normal)
        layer_put(words + settings->layer_geometric_normal, first, scale3(v.s.n, weight));
    if (settings->layer_depth)
        layer_put_long(words + settings->layer_depth, first, (v.t + load_path_null_distance(path, at)) * weight);
    if (settings->layer_z) layer_put_long(words + settings->layer_z, first, layer_z(scene, v.s.p) * weight);
    if (settings->layer_position) layer_put_long3(words + settings->layer_position, first, v.s.p, weight);
    if (settings->layer_uv) {
        layer_put_long(words + settings->layer_uv, first, v.s.uv.x * weight);
        layer_put_long(words + settings->layer_uv + LAYER_LONG_WORDS, first, v.s.uv.y * weight);
    }
    if (settings->layer_motion) screen_motion_record(scene, words + settings->layer_motion, first, v, weight);
    mask zeroth = first & (load_path_sample(path, at) == 0);
    if (settings->layer_shape_id) layer_put_id(words + settings->layer_shape_id, zeroth, v.object);
    if (settings->layer_primitive_id) layer_put_id(words + settings->layer_primitive_id, zeroth, v.primitive);
    if (settings->layer_material_id) layer_put_id(words + settings->layer_material_id, zeroth, v.material);
}

/* Adds what the `first` paths see first. */
inline void layers_see(Scene scene, Slab path, uint at, mask first, Vertex v, Scattering scatter LAYER_ARGS)
{
    first = layers_want(path, at, first);
    integer words[LAYER_MOST_WORDS], pixel_index = load_path_pixel_index(path, at);
    int before = scene.settings->layer_denoising; /* theirs come last */
    layers_put_first(scene, path, at, words, first, v, scatter, layer_weight(path, at));
    layers_add(scene, layers, first, pixel_index, words, before ? before : scene.settings->layer_words);
    mattes_record(scene, first, pixel_index, v LAYER_PASSED);
}

/* Adds what the `met` paths see here, but what they see first where other paths scout for that. Returns the paths'
 * state, which says whether denoisers have got theirs. */
inline integer layers_record(Scene scene, Slab path, uint at, mask met, Vertex v, Scattering scatter,
                             integer state LAYER_ARGS)
{
    global const Settings *settings = scene.settings;
    mask wanted = layers_want(path, at, met), first = wanted & (v.depth == 0), adds = first;
    if (DENOISERS_SEE) { /* those that are here first are among them */
        adds = wanted & ((state & PATH_SEEN) == 0);
        state |= sel_i(met, (integer)(PATH_SEEN), (integer)(0));
    }
    if (!any(adds)) return state;
    if (!LAYERS_SCOUT && any(first)) layers_see(scene, path, at, first, v, scatter LAYER_PASSED);
    if (!DENOISERS_SEE) return state;
    integer words[LAYER_MOST_WORDS];
    int before = settings->layer_denoising, albedo = settings->layer_denoising_albedo - before;
    int normal = settings->layer_denoising_normal - before;
    real weight = layer_weight(path, at);
    if (albedo >= 0) layer_put(words + albedo, adds, layer_albedo(scene, scatter, v.lambdas, v.beta, weight));
    if (normal >= 0) layer_put(words + normal, adds, scale3(layer_normal(scatter), weight));
    layers_add(scene, layers + before, adds, load_path_pixel_index(path, at), words, settings->layer_words - before);
    return state;
}

/* Twin, where there are none beside the picture. */
inline integer layers_record(Scene scene, Slab path, uint at, mask met, Vertex v, Scattering scatter,
                             integer state LAYER_ARGS) { return state; }
