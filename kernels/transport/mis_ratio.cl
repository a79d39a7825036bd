/* MIS weights of paths from the camera and paths from lights.
 *
 * A path x_1 .. x_k, seen by the camera at x_1, with the light at x_k, has three techniques: the camera's path meets
 * the light (s = 0), next-event estimation chooses the light from x_{k-1} (s = 1), or a light path is connected to the
 * camera at x_1 (t = 1). The power heuristic with exponent 2 weighs them (Veach 1997, 9.2.4 and 10.2). Each side
 * carries a recursive MIS quantity from vertex to vertex, as dVCM and dVC of Georgiev 2012, "Implementing Vertex
 * Connection and Merging": the `mis_ratio` of its path is the density of the other side's technique over the path's own
 * density. Squared distances cancel. Densities of directions p [1/sr], reverse densities, and cosines to the geometric
 * normals remain.
 *
 * The mis_ratio of a camera's path begins with the number l of light paths a sample. c is the cosine of the incident
 * ray, c' of the next ray, and p_back the density of the incident direction for a light path that comes back:
 *
 *     mis_ratio' = mis_ratio * c' / (importance * c * p) at x_1,
 *     mis_ratio' = mis_ratio * p_back * c' / (c * p)     at later vertices;
 *
 * importance: film/connect.cl. At x_1 a delta lobe leaves 0, as no light path can be connected there; at later vertices
 * p_back / p counts as 1. Times the density of emission (light_path_pdf) this is the third density over the first.
 *
 * The mis_ratio of a light path begins with 1 / l, over the gain of aiming (lights/aiming.cl). At its first vertex, q
 * is the density of next-event estimation, and
 *
 *     mis_ratio' = mis_ratio * sqrt(q^2 + p_back^2) * c' / (emission * c * p),
 *     mis_ratio' = mis_ratio * p_back * c' / (c * p)     at later vertices;
 *
 * p_back is 0 there if no ray can meet the light, q is 0 behind a delta lobe. At the connection to the camera c' / p
 * becomes importance c', with the cosine c' to the camera.
 *
 * Direct light at x_1 is left to next-event estimation of the camera's path: a light path is connected from its second
 * vertex on, and for k = 2 the third density is 0. (Next-event estimation has little noise there; splats would only add
 * noise, see bench/notes/light_paths.md.) The exception is a collision x_1 whose light no ray can meet: the camera's
 * path reaches a collision at random, so a light path is connected there too. Null surfaces change nothing. If a
 * material ends light paths (`ends_light_paths`), the camera's mis_ratio is 0.
 *
 * A vertex may be a collision in a medium. Both sides sample a collision with density transmittance times extinction,
 * and a surface with density transmittance. The transmittance between two vertices is equal both ways, and at a
 * collision the extinction takes the place of c and c'; both cancel, so that c and c' are 1 (VERTEX_COSINE). If a side
 * is connected and the other side has sampled a distance, weights leave the transmittance out, as weights of next-event
 * estimation do. Equiangular sampling changes the density of a collision; weights leave this change out too. The result
 * is unbiased: weights need only sum to 1, and both sides compute the same weights.
 *
 * If some light paths aim at specular shapes, Russian roulette ends most others at a diffuse x_{k-1}: the third density
 * is lower there (transport/roulette.cl).
 *
 * With photon merging (transport/photons/gather.cl) vertex merging at x_i is a fourth technique. x_i is the first
 * vertex from the camera that is not specular, if some vertex beyond it is specular: the camera's path and a light path
 * that end there nearly meet. Light paths that are connected to the camera find such light at x_1 more sharply, and x_i
 * is not x_1 then. With e = `merging_area`, the density of merging over the product of both paths' densities is e. So a
 * camera's path carries from x_i on (dVM of Georgiev 2012)
 *
 *     merge_ratio' = e * c' / p                              at x_i,
 *     merge_ratio' = merge_ratio * p_back * c' / (c * p)     at later vertices,
 *
 * and at a specular vertex the square of merge_ratio is added to the square of mis_ratio. A light path that has met a
 * specular vertex begins, at each vertex that is not specular, with merge_ratio' = e * c' / (l * p), and goes on as
 * above while all later vertices are specular; it counts at a connection to a specular x_1.
 *
 * In a medium x_i is a collision, and photons are merged along the ray to it (transport/photons/along.cl): e is the
 * section of the cylinder around the ray times the number of light paths. The transmittance up to x_i is left out, as
 * above.
 *
 * Densities over areas (importance, emission, 1 / e) scale with the square of the scene's size. So areas are in units
 * of `settings->mis_area_unit`, which follows the size of very large and very small scenes and is 1 m^2 in others: the
 * ratios stay inside a float, and far from the limits below.
 *
 * Whether a vertex is specular depends on the densities of both directions alone, and so is equal for both sides: a
 * delta lobe, or a density above SPECULAR_PDF (transport/photons/weight.cl). */

/* MIS quantities of a path at a vertex. */
typedef struct {
    real arrives;     /* mis_ratio / c, with importance and emission */
    real nee_pdf;     /* q at the first vertex of a light path */
    mask first;       /* the first vertex of the path */
    mask can_be_met;  /* a ray from the vertex can meet the light */
    real merge_ratio; /* added to `arrives` at a specular vertex; of a light path, at the connection alone */
    real merges;      /* density of merging at the vertex over the path's density, 0 without merging */
} MisRatio;

/* Step. */
#define MIS_RATIO_MOST 1e18f /* so that its square is finite */

inline real mis_ratio_limited(real mis_ratio) { return min_r(mis_ratio, (real)(MIS_RATIO_MOST)); }

/* Whether light paths end at a vertex: its scattering is not reversible. */
inline mask ends_light_paths(Scene scene, Vertex v)
{
    return BSDF_ENDS_LIGHT_PATHS ? mask_of(1) : shading_frame_turns(scene, v.row);
}

#include "generated/diffuse_roulette.cl"
#include "generated/mis_ratio_steps.cl"

/* sampler: of the path's sample. */
inline MisRatio mis_ratio_of_camera_path(Scene scene, Slab path, uint at, Vertex v, Sampler sampler)
{
    MisRatio r;
    real mis_ratio = load_path_mis_ratio(path, at);
    r.first = v.depth == 0;
    r.can_be_met = mask_of(1);
    r.nee_pdf = 0.0f;
    if (any(r.first)) mis_ratio = sel(r.first, mis_ratio_seen(scene, v, sampler, mis_ratio), mis_ratio);
    real goes_on = 1.0f / max_r(VERTEX_COSINE(v.s.n, v.d), (real)(1e-7f));
    goes_on = sel(ends_light_paths(scene, v), (real)(0.0f), goes_on);
    r.arrives = mis_ratio * goes_on;
    r.merge_ratio = load_path_merge_ratio(path, at) * goes_on;
    r.merges = merge_ratio_here(scene, path, at, v);
    return r;
}

/* Whether a ray may meet a row of `lights`. */
inline mask light_can_be_met(Scene scene, integer row)
{
    return (row < scene.settings->infinite_count) | light_shows(scene, row, light_at(scene, row).shape >= 0);
}

/* Density of a light path from the point of a light sample. It is computed before the material is loaded, as both
 * together would need too many registers of a GPU. */
inline real event_begins(Scene scene, Surface s, LightSample ls)
{
    return light_path_pdf(scene, ls.row, s.p, ls.wi, ls.t, ls.n);
}

/* Density of a light path along the sample over the density of next-event estimation. begins: from event_begins; p,
 * p_back: densities of the material. */
inline real mis_ratio_of_light_sample(Scene scene, MisRatio r, Surface s, LightSample ls, real begins, real p,
                                      real p_back)
{
    real chosen = sel(ls.pdf < 0.0f, ls.chance, ls.pdf);
    real emission = begins / max_r(chosen, (real)(1e-30f));
    real arrives = mis_ratio_arriving(r, mask_of(0), p, p_back) * VERTEX_COSINE(s.n, ls.wi) * emission;
    real third = after_diffuse_roulette(mis_ratio_limited(arrives * p_back), p);
    real joined = 0.0f;
    if (BSDF_IS_PHASE) joined = sel(light_can_be_met(scene, ls.row), (real)(0.0f), mis_ratio_limited(arrives));
    return sel(r.first, joined, third);
}

/* The mis_ratio of a camera's path that continues along d, with density p; delta: by a delta lobe. */
inline real mis_ratio_to_light(MisRatio r, Surface s, vec3 d, mask delta, real p, real p_back)
{
    real scatters = sel(r.first, (real)(1.0f), p_back) / max_r(p, (real)(1e-30f));
    real change = sel(delta, sel(r.first, (real)(0.0f), (real)(1.0f)), scatters);
    return mis_ratio_limited(mis_ratio_arriving(r, delta, p, p_back) * change * VERTEX_COSINE(s.n, d));
}

/* receiver: of next-event estimation at the vertex. */
inline MisRatio mis_ratio_of_light_path(Scene scene, Slab path, uint at, Vertex v, Receiver receiver)
{
    MisRatio r;
    r.arrives = load_path_mis_ratio(path, at) / max_r(VERTEX_COSINE(v.s.n, v.d), (real)(1e-7f));
    r.first = v.depth == 1;
    r.can_be_met = mask_of(1);
    r.nee_pdf = 0.0f;
    if (any(r.first)) {
        integer row = sel_i(r.first, load_path_light(path, at), (integer)(0));
        vec3 wi = neg3(v.d), n = load_path_sampled_hemisphere(path, at);
        real t = v.t + load_path_null_distance(path, at);
        real emission = common_light_begins_pdf(scene, row, v.s.p, receiver, wi, t, n, &r.nee_pdf);
        r.arrives = r.arrives / sel(r.first, max_r(emission, (real)(1e-30f)), (real)(1.0f));
        r.can_be_met = !r.first | light_can_be_met(scene, row);
    }
    r.merge_ratio = load_path_merge_ratio(path, at) / max_r(VERTEX_COSINE(v.s.n, v.d), (real)(1e-7f));
    r.merges = merge_ratio_of_photon(scene, path, at, v);
    return r;
}

/* The mis_ratio of a light path that continues along d, with density p. */
inline real mis_ratio_to_camera(MisRatio r, Surface s, vec3 d, mask delta, real p, real p_back)
{
    real back = sel(r.can_be_met, p_back, (real)(0.0f));
    real either = sel(r.first, sqrt(sqr(back) + sqr(r.nee_pdf)), back) / max_r(p, (real)(1e-30f));
    real change = sel(delta, sel(r.can_be_met, (real)(1.0f), (real)(0.0f)), either);
    return mis_ratio_limited(r.arrives * change * VERTEX_COSINE(s.n, d));
}

/* The square of the mis_ratio of a light path that is connected to the camera. p, p_back: densities of the material
 * for a camera's path. */
inline real mis_square_of_connection(Scene scene, MisRatio r, Surface s, CameraPoint c, real p, real p_back)
{
    real importance = c.importance * scene.settings->mis_area_unit, chosen = 1.0f / max_r(importance, (real)(1e-30f));
    real square = sqr(mis_ratio_to_camera(r, s, c.d, mask_of(0), chosen, p));
    return square + merge_ratio_square(r, s, c.d, importance, p, p_back);
}

/* MIS weight of a light sample of next-event estimation; p: its density by the material and a guide. */
inline real event_weight(Scene scene, MisRatio r, Surface s, LightSample ls, real begins, BsdfPair pair, real p)
{
    real third = mis_ratio_of_light_sample(scene, r, s, ls, begins, pair.p, pair.p_back);
    return mis_weight_of_three(ls.pdf, pair.p, third);
}

/* Stores the ratios of camera paths that `scatters` along `onward`. Returns the density of that direction. */
inline real keep_mis_ratio_to_light(Slab path, uint at, mask scatters, MisRatio r, Vertex *v, vec3 onward,
                                    mask delta, BsdfSample bs)
{
    store_path_mis_ratio(path, at, scatters, mis_ratio_to_light(r, v->s, onward, delta, bs.p, bs.p_back));
    keep_merge_ratio_to_light(path, at, scatters, r, v, onward, delta, bs.p, bs.p_back);
    return bs.p;
}

/* Stores the ratios of light paths that continue along `onward`. Returns the lanes that continue. */
inline mask keep_mis_ratio_to_camera(Scene scene, Slab path, uint at, mask next, mask null, MisRatio r, Vertex *v,
                                     vec3 onward, BsdfSample bs)
{
    next = next & !ends_light_paths(scene, *v);
    mask delta = (bs.lobe & LOBE_DELTA) != 0;
    store_path_mis_ratio(path, at, next & !null, mis_ratio_to_camera(r, v->s, onward, delta, bs.p, bs.p_back));
    keep_merge_ratio_to_camera(path, at, next & !null, null, r, v, onward, delta, bs.p, bs.p_back);
    return next;
}

/* MIS weight of the connection of a light path to the camera; clears `shine` where the camera's path is better. */
inline real mis_weight_of_connection(Scene scene, MisRatio r, Vertex v, BsdfPair pair, CameraPoint c, mask *shine)
{
    mask hidden = mask_of(scene.settings->hide_lights != 0) & (v.s.light >= 0);
    mask joined = BSDF_IS_PHASE ? !r.first | !r.can_be_met : !r.first;
    *shine = *shine & joined & !hidden & !ends_light_paths(scene, v);
    return 1.0f / (1.0f + mis_square_of_connection(scene, r, v.s, c, pair.p, pair.p_back));
}

/* Twin, where paths are not weighed against light paths. */
inline MisRatio mis_ratio_nothing(void) { MisRatio r = {0.0f, 0.0f, mask_of(0), mask_of(0), 0.0f, 0.0f}; return r; }
inline MisRatio mis_ratio_of_camera_path(Scene scene, Slab path, uint at, Vertex v, Sampler sampler)
{
    return mis_ratio_nothing();
}
inline MisRatio mis_ratio_of_light_path(Scene scene, Slab path, uint at, Vertex v, Receiver receiver)
{
    return mis_ratio_nothing();
}
inline real event_begins(Scene scene, Surface s, LightSample ls) { return (real)(0.0f); }
inline real event_weight(Scene scene, MisRatio r, Surface s, LightSample ls, real begins, BsdfPair pair,
                         real p) { return sel(ls.pdf < 0.0f, (real)(1.0f), mis_weight(ls.pdf, p)); }
inline real keep_mis_ratio_to_light(Slab path, uint at, mask scatters, MisRatio r, Vertex *v, vec3 onward,
                                    mask delta, BsdfSample bs) { return bs.pdf; }
inline mask keep_mis_ratio_to_camera(Scene scene, Slab path, uint at, mask next, mask null, MisRatio r, Vertex *v,
                                     vec3 onward, BsdfSample bs) { return next; }
inline real mis_weight_of_connection(Scene scene, MisRatio r, Vertex v, BsdfPair pair, CameraPoint c, mask *shine)
{
    return (real)(1.0f);
}

/* Step aimed: the first mis_ratio of a light path over the gain of aiming, see lights/aiming.cl. */
inline real mis_ratio_aimed(real mis_ratio, LightRay r) { return mis_ratio / r.gain; }

/* Twin, without aimed light paths. */
inline real mis_ratio_aimed(real mis_ratio, LightRay r) { return mis_ratio; }

/* Step camera: the mis_ratio of a camera's path at its first vertex, if light paths are connected to the camera. */
inline real mis_ratio_seen(Scene scene, Vertex v, Sampler sampler, real mis_ratio)
{
    CameraPoint c = camera_connect(scene, v.s.p, mask_of(0), sampler_pair(sampler, (natural)(DIMENSION_LENS)));
    return sel(c.seen, mis_ratio / max_r(c.importance * scene.settings->mis_area_unit, (real)(1e-30f)), (real)(0.0f));
}

/* Twin, without connections of light paths to the camera. */
inline real mis_ratio_seen(Scene scene, Vertex v, Sampler sampler, real mis_ratio) { return (real)(0.0f); }

/* Step chosen: the chance of the light for the mis_ratio of a light path at its first vertex. The light tree chooses
 * by the gloss of the surface (receiver), so the chance depends on the next direction of the light path. */
inline MisRatio mis_ratio_chosen(Scene scene, Slab path, uint at, Vertex v, MisRatio r, Receiver receiver)
{
    if (any(r.first)) {
        integer row = sel_i(r.first, load_path_light(path, at), (integer)(0));
        real chance = common_light_tree_pmf(scene, row, v.s.p, receiver);
        r.nee_pdf *= sel(r.first, chance, (real)(1.0f));
    }
    return r;
}

/* Twin, where the chance of a light does not depend on the direction of its light. */
inline MisRatio mis_ratio_chosen(Scene scene, Slab path, uint at, Vertex v, MisRatio r, Receiver receiver) { return r; }

/* Step merging: the merge_ratio, which is added to the mis_ratio at the next specular vertex. */

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

/* Step area: `merging_area` in units of mis_area_unit. */
#define mis_merging_area(scene, pass, v) (merging_area(scene, pass) / (scene).settings->mis_area_unit)

/* Step area_along: `merging_area` at a collision, in units of mis_area_unit. */
#include "transport/photons/media.cl"

/* 0 in a medium without photons. */
inline real mis_merging_area(Scene scene, integer pass, Vertex v)
{
    mask merges = MATERIAL_KIND(merging_phase(scene, v.media.medium)) == (integer)(BSDF_KIND);
    Medium m = medium_load(scene, sel_i(merges, v.media.medium, (integer)(0)), v.lambdas);
    real area = merging_area_along(scene, pass, m.sigma_t) / scene.settings->mis_area_unit;
    return sel(merges, area, (real)(0.0f));
}
