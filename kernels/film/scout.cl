/* A path that scouts goes through fog, holes and hidden lights to the first surface, which layers have, and ends. */
#include "generated/scouts.cl"

/* Takes those of the `active` paths a surface further that scout; returns the others. */
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
