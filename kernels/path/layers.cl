/* Layers beside the picture: what the camera sees at a path's first surface and, for denoisers, at the first one that
 * is not a mirror or smooth glass, as dark and as coloured as what is before lets it through. */
#include "film/layers.cl"

/* Points of media have no normal, and no name. */
#if BSDF_IS_PHASE
#define LAYER_NORMAL(scatter) v3(0.0f, 0.0f, 0.0f)
#else
#define LAYER_NORMAL(scatter) (scatter).shading.frame.n
#endif

/* What a surface reflects, as the film's sensor tells it; `before`: of what is before it. */
inline vec3 layer_albedo(Scene scene, Scattering scatter, Wavelengths lambdas, Spectrum before, real weight)
{
    Spectrum albedo = spectrum_mul(bsdf_albedo(scatter.bsdf), before);
    return scale3(film_value(scene, albedo, lambdas), weight);
}

#if LAYER_Z
/* How far a point is from the camera along its axis, the third column of `to_world` [m]. */
inline real layer_z(Scene scene, vec3 p)
{
    global const float *m = (global const float *)scene.camera;
    float length = sqrt(m[2] * m[2] + m[6] * m[6] + m[10] * m[10]);
    return ((p.x - m[3]) * m[2] + (p.y - m[7]) * m[6] + (p.z - m[11]) * m[10]) / length;
}
#endif

/* Adds what the `met` paths see here. Returns the paths' state, which says whether denoisers have got theirs. */
inline integer layers_record(Scene scene, Slab path, uint at, LAYER_ARGS, mask met, Vertex v, Scattering scatter,
                             integer state)
{
    mask wanted = layers_want(path, at, met), first = wanted & (v.depth == 0), adds = first;
#if LAYER_DENOISING && !BSDF_DELTA
    mask seen = wanted & ((state & PATH_SEEN) == 0); /* those that are here first are among them */
    state |= sel_i(met, (integer)(PATH_SEEN), (integer)(0));
    adds = seen;
#endif
    if (!any(adds)) return state;
    real weight = layer_weight(path, at);
    integer words[PIXEL_LAYER_WORDS];
    int count = PIXEL_LAYER_WORDS;
    words[0] = sel_i(first, (integer)(1), (integer)(0));
#if LAYER_ALBEDO
    layer_put(words + LAYER_ALBEDO, first, layer_albedo(scene, scatter, v.lambdas, spectrum_of(1.0f), weight));
#endif
#if LAYER_SHADING_NORMAL
    layer_put(words + LAYER_SHADING_NORMAL, first, scale3(LAYER_NORMAL(scatter), weight));
#endif
#if LAYER_GEOMETRIC_NORMAL
    layer_put(words + LAYER_GEOMETRIC_NORMAL, first, scale3(v.s.n, weight));
#endif
#if LAYER_DEPTH
    layer_put_long(words + LAYER_DEPTH, first, (v.t + load_path_null_distance(path, at)) * weight);
#endif
#if LAYER_Z
    layer_put_long(words + LAYER_Z, first, layer_z(scene, v.s.p) * weight);
#endif
#if LAYER_POSITION
    layer_put_long(words + LAYER_POSITION, first, v.s.p.x * weight);
    layer_put_long(words + LAYER_POSITION + 3, first, v.s.p.y * weight);
    layer_put_long(words + LAYER_POSITION + 6, first, v.s.p.z * weight);
#endif
#if LAYER_UV
    layer_put_long(words + LAYER_UV, first, v.s.uv.x * weight);
    layer_put_long(words + LAYER_UV + 3, first, v.s.uv.y * weight);
#endif
#if SCREEN_MOTION
#if BSDF_IS_PHASE /* media stand still */
    integer mover = -1;
#else
    integer mover = v.object;
#endif
#if MOVES_VERTICES || MOVES_SPHERES
    vec3 first_p = add3(v.s.p, v.s.to_open), last_p = add3(v.s.p, v.s.to_close);
#else
    vec3 first_p = v.s.p, last_p = v.s.p;
#endif
    screen_motion_put(words + LAYER_MOTION, first,
                      screen_motion(scene, mover, v.s.p, first_p, last_p, mask_of(0)), weight);
#elif LAYER_MOTION
    for (int i = 0; i < 12; i++) words[LAYER_MOTION + i] = 0;
#endif
#if LAYER_IDS
    mask zeroth = first & (load_path_sample(path, at) == 0);
#if LAYER_SHAPE_ID
    layer_put_id(words + LAYER_SHAPE_ID, zeroth, v.object);
#endif
#if LAYER_PRIMITIVE_ID
    layer_put_id(words + LAYER_PRIMITIVE_ID, zeroth, v.primitive);
#endif
#if LAYER_MATERIAL_ID
    layer_put_id(words + LAYER_MATERIAL_ID, zeroth, v.material);
#endif
#endif
#if LAYER_DENOISING && BSDF_DELTA /* which come last */
    count = LAYER_DENOISING;
#elif LAYER_DENOISING
#if LAYER_DENOISING_ALBEDO
    layer_put(words + LAYER_DENOISING_ALBEDO, seen, layer_albedo(scene, scatter, v.lambdas, v.beta, weight));
#endif
#if LAYER_DENOISING_NORMAL
    layer_put(words + LAYER_DENOISING_NORMAL, seen, scale3(LAYER_NORMAL(scatter), weight));
#endif
#endif
    integer pixel_index = load_path_pixel_index(path, at);
    layers_add(scene, layers, adds, pixel_index, words, count);
#if MATTE_OBJECT && !BSDF_IS_PHASE
    mattes_add(mattes, first, pixel_index, MATTE_OBJECT - 1, v.object);
#endif
#if MATTE_MATERIAL && !BSDF_IS_PHASE
    mattes_add(mattes, first, pixel_index, MATTE_MATERIAL - 1, v.material);
#endif
    return state;
}
