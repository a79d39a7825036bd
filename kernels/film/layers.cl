/* Layers beside the picture, in memory: sums over the first LAYER_SAMPLES samples of each pixel, so that they cost
 * little; whole numbers, which add in any order. Step `record` has the summands.
 *
 * `layers` has Settings.layer_words words for each pixel, side by side, as its samples then touch a single line of a
 * cache: the number of samples; a word for each number near 1, in units of 2^-22; four for other numbers, in units of
 * 2^18, 2^-6, 2^-30 and 2^-54, the lower three below 2^24, all of the number's sign; a word for an id of the sample of
 * number 0, plus 1. No word leaves its 32 bits, so words add without a carry. Settings.layer_<name> is the first word
 * of a layer. */
/* Step. */
#include "core/fixed.cl"
#include "generated/layer_sizes.cl"
#define LAYER_SAMPLES 64
#define LAYER_UNITS 0x1p22f
#define LAYER_LARGEST 7.9f /* times samples and units it is less than 2^31 */

/* Whether layers have a sample. */
inline mask layers_want(Slab path, uint at, mask m) { return m & (load_path_sample(path, at) < LAYER_SAMPLES); }

/* A sample's weight by the pixel filter: some filters have lobes below 0. */
#if FILM_WEIGHTS
#define layer_weight(path, at) ((real)(1.0f))
#else
#define layer_weight(path, at) load_path_weight(path, at)
#endif

/* Adds `count` words, each of all lanes, to the first words of their pixels. Lanes that add are listed first, as a
 * branch for each lane would take longer. With a single plane a slot owns its pixel, and needs no atomic operation. */
inline void layers_add(Scene scene, global uint *layers, mask m, integer pixel_index, const integer *words, int count)
{
    const int *adds = (const int *)&m, *pixels = (const int *)&pixel_index;
    const uint *added = (const uint *)words;
    int lanes[LANES], n = 0;
    for (int i = 0; i < LANES; i++) {
        lanes[n] = i;
        n += adds[i] != 0;
    }
    for (int j = 0; j < n; j++) {
        int i = lanes[j];
        global uint *at = layers + (size_t)pixels[i] * scene.settings->layer_words;
        if (scene.settings->planes == 1)
            for (int k = 0; k < count; k++) at[k] += added[k * LANES + i];
        else
            for (int k = 0; k < count; k++) sums_add_word(at + k, added[k * LANES + i]);
    }
}

/* Counts the `unseen` paths, which have met nothing; the others count at the first surface. */
inline void layers_count(Scene scene, Slab path, uint at, mask unseen LAYER_ARGS)
{
    const integer one = 1;
    mask m = layers_want(path, at, unseen);
    if (any(m)) layers_add(scene, layers, m, load_path_pixel_index(path, at), &one, 1);
}

/* Puts three numbers near 1, of the lanes of m, into words for a sum. */
inline void layer_put(integer *words, mask m, vec3 v)
{
    real most = sel(m, (real)(LAYER_LARGEST), (real)(0.0f));
    words[0] = to_integer(clamp_r(v.x, -most, most) * LAYER_UNITS);
    words[1] = to_integer(clamp_r(v.y, -most, most) * LAYER_UNITS);
    words[2] = to_integer(clamp_r(v.z, -most, most) * LAYER_UNITS);
}

/* Puts a number below 2^43: its digits from 2^-54 on, so that small numbers keep theirs, above 0 and below. */
inline void layer_put_long(integer *words, mask m, real v)
{
    v = sel(m & (fabs(v) < 0x1p43f), v, (real)(0.0f));
    real unit = 0x1p18f, digits = trunc(v * 0x1p-18f);
    words[0] = to_integer(digits);
    for (int i = 1; i < LAYER_LONG_WORDS; i++) {
        v -= digits * unit; /* exact */
        unit *= 0x1p-24f;
        digits = trunc(v / unit);
        words[i] = to_integer(digits);
    }
}

/* Puts an id. */
inline void layer_put_id(integer *words, mask m, integer id) { words[0] = sel_i(m, id + 1, (integer)(0)); }

/* Names that a pixel's samples have met, with counts: words of a list, ascending. A word has 1 more than the
 * name's number in its upper 25 bits and the count in its lower 7; 0 is no name. Of more names the list keeps
 * the first of the scene: a slot keeps the least number, with all its counts, and hands the others to the next slot. So
 * the list depends neither on the order of samples nor on the adding device, and lists of films add likewise. */
inline void matte_add(global uint *list, uint number)
{
    uint word = ((number + 1u) << 7) | 1u;
    for (int i = 0; i < LAYER_MATTE_SLOTS && word; i++) {
        volatile global uint *slot = list + i;
        uint held = *slot;
        for (;;) {
            uint kept = held, onward = word;
            if (!held || (held >> 7) == (word >> 7)) kept = held ? held + (word & 127u) : word, onward = 0u;
            else if (word < held) kept = word, onward = held;
            uint found = kept == held ? held : atomic_cmpxchg(slot, held, kept);
            if (found == held) {
                word = onward;
                break;
            }
            held = found;
        }
    }
}

/* Adds the names with these numbers to the list `which` of the pixels. */
inline void mattes_add(Scene scene, global uint *mattes, mask m, integer pixel_index, int which, integer number)
{
    const int *adds = (const int *)&m, *pixels = (const int *)&pixel_index;
    const uint *numbers = (const uint *)&number;
    for (int i = 0; i < LANES; i++)
        if (adds[i]) {
            size_t list = (size_t)pixels[i] * scene.settings->mattes + which;
            matte_add(mattes + list * LAYER_MATTE_SLOTS, numbers[i]);
        }
}

/* Twin, where there are none beside the picture. */
inline void layers_count(Scene scene, Slab path, uint at, mask unseen LAYER_ARGS) {}

/* Step record: the surface that the camera sees first and, for denoisers, the first surface that is not a mirror or
 * smooth glass, as dark and as coloured as the surfaces before it let it through. */
#include "film/layers.cl"
#include "generated/scouts.cl"

#include "generated/mattes.cl"
#define DENOISERS_SEE (settings->layer_denoising && !BSDF_DELTA) /* past mirrors and smooth glass */

/* The albedo of a surface by the film's sensor; `before`: throughput of the path to it. */
inline vec3 layer_albedo(Scene scene, Scattering scatter, Wavelengths lambdas, Spectrum before, real weight)
{
    Spectrum albedo = spectrum_mul(bsdf_albedo_in(scene, scatter.bsdf), before);
    return scale3(film_value(scene, albedo, lambdas), weight);
}

/* A point's distance from the camera along its axis, the third column of `to_world` at the path's time [m]. */
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

/* Puts the `first` surface that the camera sees; Settings.layer_<name> is 0 without such a layer. */
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

/* Adds the first surface of the `first` paths. */
inline void layers_see(Scene scene, Slab path, uint at, mask first, Vertex v, Scattering scatter LAYER_ARGS)
{
    first = layers_want(path, at, first);
    integer words[LAYER_MOST_WORDS], pixel_index = load_path_pixel_index(path, at);
    int before = scene.settings->layer_denoising; /* theirs come last */
    layers_put_first(scene, path, at, words, first, v, scatter, layer_weight(path, at));
    layers_add(scene, layers, first, pixel_index, words, before ? before : scene.settings->layer_words);
    mattes_record(scene, first, pixel_index, v LAYER_PASSED);
}

/* Adds the surface of the `met` paths, but not a first surface where other paths scout for it. Returns the paths'
 * state, which says whether the layers of denoisers have theirs. */
inline integer layers_record(Scene scene, Slab path, uint at, mask met, Vertex v, Scattering scatter,
                             integer state LAYER_ARGS)
{
    global const Settings *settings = scene.settings;
    mask wanted = layers_want(path, at, met), first = wanted & (v.depth == 0), adds = first;
    if (DENOISERS_SEE) { /* paths at their first surface are among them */
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

/* Step mattes: adds the names of the objects and materials that the camera sees to mattes; points of media have none.
 * */
inline void mattes_record(Scene scene, mask first, integer pixel_index, Vertex v LAYER_ARGS)
{
    if (BSDF_IS_PHASE) return;
    int object = scene.settings->matte_object, material = scene.settings->matte_material;
    if (object) mattes_add(scene, mattes, first, pixel_index, object - 1, v.object);
    if (material) mattes_add(scene, mattes, first, pixel_index, material - 1, v.material);
}

/* Twin, where there are none. */
inline void mattes_record(Scene scene, mask first, integer pixel_index, Vertex v LAYER_ARGS) {}
