/* Where fog, thin glass or masks decide by chance the first surface of a path, a path goes ahead of each of a pixel's
 * first samples, to the first surface, for layers alone. */

/* Step. */
#define LAYERS_SCOUT 1
#define PATH_SCOUTS 0x40000000

inline mask path_scouts(integer state) { return (state & PATH_SCOUTS) != 0; }

/* Twin, where no path scouts. */
#define LAYERS_SCOUT 0

inline mask path_scouts(integer state) { return mask_of(0); }

/* Step begin: the paths that ended and only scouted: their samples begin anew. */
#include "generated/scouts.cl"

inline mask scouts_ended(PathEnd end) { return end.ended & end.begun & path_scouts(end.state); }

/* The bits of Path.state at the beginning of paths that go ahead of their samples. */
inline integer scouts_begin(mask ended, integer sample)
{
    return sel_i(!ended & (sample < LAYER_SAMPLES), (integer)(PATH_SCOUTS), (integer)(0));
}

/* The paths that have ended and add to layers. */
inline mask layers_end(PathEnd end, mask scouted) { return scouted; }

/* Twin, where no path scouts. */
inline mask scouts_ended(PathEnd end) { return mask_of(0); }
inline integer scouts_begin(mask ended, integer sample) { return (integer)(0); }
inline mask layers_end(PathEnd end, mask scouted) { return end.ended & end.begun; }

/* Step choice: paths that scout choose among the parts of a mixture by the numbers of their samples, turned so that the
 * first sample has 1/2. So an id is that of the part whose share is the half of the whole or more, and no chance. */
#include "transport/path_state.cl"
#include "generated/scouts.cl"

inline real scout_choice(Scene scene, natural key, integer state, natural dimension, real u)
{
    Sampler first = pixel_sampler(scene.settings, key, (integer)(0));
    real turned = u + 0.5f - sampler_pair(first, dimension).y;
    return sel(path_scouts(state), turned - floor(turned), u);
}

/* Twin, where no path scouts. */
inline real scout_choice(Scene scene, natural key, integer state, natural dimension, real u) { return u; }

/* Step vertex: a path that scouts goes through fog, holes and hidden lights to the first surface, which layers have,
 * and ends. */
#include "generated/scouts.cl"

/* Takes the `active` paths that scout a surface further; returns the others. */
inline mask scout_vertex(Scene scene, Slab path, uint at, mask active, Vertex v LAYER_ARGS)
{
    mask scouts = active & path_scouts(v.state);
    if (!any(scouts)) return active;
    mask hidden = scouts & (v.s.light >= 0) & mask_of(scene.settings->hide_lights != 0);
    if (any(hidden)) hide_light(path, at, hidden, v);
    mask met = scouts & !hidden;
    if (BSDF_IS_NULL) {
        mask next = met & vertex_continues(scene, v, mask_of(1));
        vertex_leave(path, at, next, mask_of(1), v, v.d, v.beta);
        store_path_cone(path, at, next, cone_word(v.cone));
        vertex_end(path, at, met, next, mask_of(1), v.state);
    } else if (any(met)) {
        Sampler sampler = pixel_sampler(scene.settings, load_path_pixel_key(path, at), load_path_sample(path, at));
        layers_see(scene, path, at, met, v, vertex_scattering(scene, path, at, met, v, sampler) LAYER_PASSED);
        store_path_state(path, at, met, v.state + 1 - PATH_ALIVE);
    }
    return active & !scouts;
}

/* Twin, where no path scouts, or none meets the material. */
inline mask scout_vertex(Scene scene, Slab path, uint at, mask active, Vertex v LAYER_ARGS) { return active; }
