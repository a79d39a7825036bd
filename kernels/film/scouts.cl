/* Scouts. Fog, thin glass or masks may choose the first surface of a path at random. In such scenes a scout, a path for
 * layers alone, runs to the first surface before each of a pixel's first samples. */

/* Step. */
#define LAYERS_SCOUT 1
#define PATH_SCOUTS 0x40000000

inline mask path_scouts(integer state) { return (state & PATH_SCOUTS) != 0; }

/* Twin, where no path scouts. */
#define LAYERS_SCOUT 0

inline mask path_scouts(integer state) { return mask_of(0); }

/* Step begin: scouts that have ended; their samples begin after them. */
#include "generated/scouts.cl"

inline mask scouts_ended(PathEnd end) { return end.ended & end.begun & path_scouts(end.state); }

/* The bits of Path.state of a scout, if the next path is a scout. */
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

/* Step choice: a scout chooses a part of a mixture by a random number that is shifted, modulo 1, so that the first
 * sample's number is 1/2. So the first sample's id is never random: it is the id of the part that covers 1/2. */
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

/* Step vertex: a scout passes fog, holes and hidden lights, adds the first surface to the layers, and ends. */
#include "generated/scouts.cl"

/* Takes the scouts among the `active` paths a surface further; returns the other paths. */
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

/* Twin, where there are no scouts, or no scout meets the material. */
inline mask scout_vertex(Scene scene, Slab path, uint at, mask active, Vertex v LAYER_ARGS) { return active; }
