/* What merging adds to transport/rivals.cl: a number that is `pending` until something sharp follows. */

#include "transport/photons/weight.cl"
#include "generated/rival_area.cl"

/* The rival of a camera's path that arrives, if the vertex scatters with these densities. */
inline real rival_arrives(Rival r, mask delta, real p, real p_back)
{
    real more = sel(rival_sharp(delta, p, p_back), r.pending, (real)(0.0f));
    return sqrt(sqr(r.arrives) + sqr(more));
}

/* What merging at a vertex has over the density of a camera's path, 0 where there is none. */
inline real rival_merges_here(Scene scene, Slab path, uint at, Vertex v)
{
    if (!BSDF_MERGES) return 0.0f;
    real area = rival_merging_area(scene, load_path_sample(path, at), v);
    return sel(merging_here(v.state, v.depth), area, (real)(0.0f));
}

/* And over that of a light path. */
inline real rival_left_here(Scene scene, Slab path, uint at, Vertex v)
{
    if (!BSDF_MERGES) return 0.0f;
    real area = rival_merging_area(scene, merging_pass(scene, load_path_sample(path, at)), v);
    return sel((v.state & PATH_SHARP) != 0, area / scene.settings->light_paths, (real)(0.0f));
}

/* What joins that rival where something further is sharp. */
inline real rival_pending(Rival r, Surface s, vec3 d, mask delta, real p, real p_back)
{
    real either = sqrt(sqr(r.pending * p_back) + sqr(r.merges)) / max_r(p, (real)(1e-30f));
    return sel(rival_sharp(delta, p, p_back), (real)(0.0f), rival_limited(either * VERTEX_COSINE(s.n, d)));
}

/* What is pending along it. */
inline real rival_merged(Rival r, Surface s, vec3 d, mask delta, real p, real p_back)
{
    real begun = sel(rival_sharp(delta, p, p_back), r.pending * p_back, r.merges) / max_r(p, (real)(1e-30f));
    return rival_limited(sel(delta, r.pending, begun) * VERTEX_COSINE(s.n, d));
}

/* What it adds to the square of the rival of a light path that is joined to the camera along d. */
inline real rival_merged_square(Rival r, Surface s, vec3 d, real importance, real p, real p_back)
{
    real more = rival_limited(r.pending * p * importance * VERTEX_COSINE(s.n, d));
    return sel(rival_sharp(mask_of(0), p, p_back), sqr(more), (real)(0.0f));
}

/* What is pending for the paths of m that go on along `onward`, from the camera and from a light. */
inline void rival_pends_to_light(Slab path, uint at, mask m, Rival r, Vertex *v, vec3 onward, mask delta, real p,
                                 real p_back)
{
    v->state -= sel_i(rival_sharp(delta, p, p_back), (integer)(0), v->state & PATH_SHARP);
    store_path_pending(path, at, m, rival_pending(r, v->s, onward, delta, p, p_back));
}
inline void rival_pends_to_camera(Slab path, uint at, mask m, mask null, Rival r, Vertex *v, vec3 onward, mask delta,
                                  real p, real p_back)
{
    store_path_pending(path, at, m, rival_merged(r, v->s, onward, delta, p, p_back));
    v->state = v->state | sel_i(rival_sharp(delta, p, p_back) & !null, (integer)(PATH_SHARP), (integer)(0));
}

/* Twin, where no photons are merged. */
#define rival_arrives(r, delta, p, p_back) ((r).arrives)
#define rival_merges_here(scene, path, at, v) ((real)(0.0f))
#define rival_left_here(scene, path, at, v) ((real)(0.0f))
#define rival_merged_square(r, s, d, importance, p, p_back) ((real)(0.0f))
#define rival_pends_to_light(path, at, m, r, v, onward, delta, p, p_back)
#define rival_pends_to_camera(path, at, m, null, r, v, onward, delta, p, p_back)
