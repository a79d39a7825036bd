/* The merge_ratio of transport/mis_ratio.cl, which is added to the mis_ratio at the next specular vertex. */

#include "transport/photons/weight.cl"
#include "generated/mis_merging_area.cl"

/* The incident mis_ratio of a camera's path, with the merge_ratio if the vertex is specular. */
inline real mis_ratio_arriving(MisRatio r, mask delta, real p, real p_back)
{
    real more = sel(mis_specular(delta, p, p_back), r.merge_ratio, (real)(0.0f));
    return sqrt(sqr(r.arrives) + sqr(more));
}

/* The density of merging at a vertex over the density of a camera's path, 0 without merging. */
inline real merge_ratio_here(Scene scene, Slab path, uint at, Vertex v)
{
    if (!BSDF_MERGES) return 0.0f;
    real area = mis_merging_area(scene, load_path_sample(path, at), v);
    return sel(merging_here(v.state, v.depth), area, (real)(0.0f));
}

/* The density of merging at a photon over the density of its light path. */
inline real merge_ratio_of_photon(Scene scene, Slab path, uint at, Vertex v)
{
    if (!BSDF_MERGES) return 0.0f;
    real area = mis_merging_area(scene, merging_pass(scene, load_path_sample(path, at)), v);
    return sel((v.state & PATH_SHARP) != 0, area / scene.settings->light_paths, (real)(0.0f));
}

/* The merge_ratio of a camera's path that continues along d. */
inline real merge_ratio_to_light(MisRatio r, Surface s, vec3 d, mask delta, real p, real p_back)
{
    real either = sqrt(sqr(r.merge_ratio * p_back) + sqr(r.merges)) / max_r(p, (real)(1e-30f));
    return sel(mis_specular(delta, p, p_back), (real)(0.0f), mis_ratio_limited(either * VERTEX_COSINE(s.n, d)));
}

/* The merge_ratio of a light path that continues along d. */
inline real merge_ratio_to_camera(MisRatio r, Surface s, vec3 d, mask delta, real p, real p_back)
{
    real begun = sel(mis_specular(delta, p, p_back), r.merge_ratio * p_back, r.merges) / max_r(p, (real)(1e-30f));
    return mis_ratio_limited(sel(delta, r.merge_ratio, begun) * VERTEX_COSINE(s.n, d));
}

/* The square that merging adds to the mis_ratio of a light path that is connected to the camera along d. */
inline real merge_ratio_square(MisRatio r, Surface s, vec3 d, real importance, real p, real p_back)
{
    real more = mis_ratio_limited(r.merge_ratio * p * importance * VERTEX_COSINE(s.n, d));
    return sel(mis_specular(mask_of(0), p, p_back), sqr(more), (real)(0.0f));
}

/* Store the merge_ratio of paths in m that continue along `onward`, from the camera and from a light. */
inline void keep_merge_ratio_to_light(Slab path, uint at, mask m, MisRatio r, Vertex *v, vec3 onward, mask delta,
                                      real p, real p_back)
{
    v->state -= sel_i(mis_specular(delta, p, p_back), (integer)(0), v->state & PATH_SHARP);
    store_path_merge_ratio(path, at, m, merge_ratio_to_light(r, v->s, onward, delta, p, p_back));
}
inline void keep_merge_ratio_to_camera(Slab path, uint at, mask m, mask null, MisRatio r, Vertex *v, vec3 onward,
                                       mask delta, real p, real p_back)
{
    store_path_merge_ratio(path, at, m, merge_ratio_to_camera(r, v->s, onward, delta, p, p_back));
    v->state = v->state | sel_i(mis_specular(delta, p, p_back) & !null, (integer)(PATH_SHARP), (integer)(0));
}

/* Twin, without photon merging. */
inline real mis_ratio_arriving(MisRatio r, mask delta, real p, real p_back) { return r.arrives; }
inline real merge_ratio_here(Scene scene, Slab path, uint at, Vertex v) { return (real)(0.0f); }
inline real merge_ratio_of_photon(Scene scene, Slab path, uint at, Vertex v) { return (real)(0.0f); }
inline real merge_ratio_square(MisRatio r, Surface s, vec3 d, real importance, real p, real p_back)
{
    return (real)(0.0f);
}
inline void keep_merge_ratio_to_light(Slab path, uint at, mask m, MisRatio r, Vertex *v, vec3 onward, mask delta,
                                      real p, real p_back) {}
inline void keep_merge_ratio_to_camera(Slab path, uint at, mask m, mask null, MisRatio r, Vertex *v, vec3 onward,
                                       mask delta, real p, real p_back) {}
