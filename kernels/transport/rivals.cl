/* Light paths that are weighed against paths from the camera.
 *
 * A path x_1 .. x_k, seen by the camera at x_1, with the light at x_k, may be found in three ways: the camera's path
 * meets the light, or chooses it from x_{k-1}, or a light path is joined to the camera at x_1. The power heuristic with
 * exponent 2 weighs them (Veach 1997, 9.2.4 and 10.2). Each side carries one number from vertex to vertex, as in
 * Georgiev 2012, "Implementing Vertex Connection and Merging": the `rival` of its path, the density of what the other
 * side does over its own. Squared distances cancel, and what is left are the densities of directions p [1/sr], their
 * reverses, and cosines to the geometric normals.
 *
 * A camera's path begins with the number l of light paths a sample. With c the cosine to where the ray comes from, c'
 * to where it goes, and p_back the density with which a light path would come back along it:
 *
 *     rival' = rival / (importance c) c' / p at x_1,    rival / c p_back c' / p at further ones;
 *
 * importance: film/connect.cl. At x_1 a delta lobe leaves 0, as no light path can be joined there; at further vertices
 * p_back / p counts as 1. Times the density of emission (light_path_pdf) that is the third density over the first.
 *
 * A light path begins with 1 / l, over what aiming gains (lights/aiming.cl). At its first vertex, with q the density
 * of next-event estimation there,
 *
 *     rival' = rival / (emission c) sqrt(q^2 + p_back^2) c' / p,    then rival / c p_back c' / p;
 *
 * p_back is 0 there for a light that no ray meets, q is 0 behind a delta lobe. At the joint c' / p becomes
 * importance c', c' being that to the camera.
 *
 * Light that comes to x_1 from the light itself is left to the camera's path, which chooses a light there: a light
 * path is joined from its second vertex on, and for k = 2 the third density is 0. (Splats of light that next-event
 * estimation finds without noise are noise only, see bench/notes/light_paths.md.) But where x_1 is a collision, which
 * the camera's path comes to by chance, and no ray meets the light, a light path is joined there too. Null surfaces
 * change nothing.
 * Where a material ends light paths (`rival_ends`) the camera's rival is 0.
 *
 * A vertex may be a collision in a medium. Either side flies to it with a density of transmittance times extinction, to
 * a surface with one of transmittance. On the way between two vertices the transmittance is the same both ways, and at
 * a collision the extinction stands where c and c' stand at a surface; all of it cancels, so that c and c' are 1
 * (VERTEX_COSINE). Where one side is joined to an end and the other has flown, weights leave the transmittance out, as
 * those of next-event estimation do, and so they do what equiangular sampling changes: any weights that sum to one
 * serve, and both sides know these.
 *
 * Where some light paths aim at what is sharp, few of the others go on from x_{k-1} if that is dull: the third density
 * is less there (transport/rival_dull.cl).
 *
 * Where photons are merged (transport/photons/gather.cl) the same path may also be found at x_i, the first vertex from
 * the camera that is not sharp, if some vertex beyond it is: the camera's path and a light path that end there nearly
 * meet. Where light paths are joined to the camera, what it sees by itself they find, sharper: x_i is not x_1 then.
 * With e = `merging_area` the density of merging over both paths' own is e. So a camera's path carries at x_i
 *
 *     pending' = e c' / p,    then pending / c p_back c' / p,
 *
 * and where it meets something sharp the square of its rival gains the square of `pending`. A light path that has met
 * something sharp begins, at each vertex that is not, with pending' = e / l c' / p, and goes on as above while all that
 * follows is sharp; it counts at a joint to a sharp x_1.
 *
 * In a medium x_i is a collision, and photons are merged along the ray to it (transport/photons/along.cl): e is the
 * section of the cylinder around the ray times the number of light paths. What passes up to x_i is left out of it, as
 * above.
 *
 * Densities over areas, which importance, emission and 1 / e are, grow and fall with the square of the scene's size. So
 * areas are in units of `settings->rival_area`, which follows the size of very large and very small scenes and is 1 m^2
 * in others: rivals stay inside a float, and far from the limits below.
 *
 * What is sharp depends on the densities of both ways alone, and so is the same for both sides: a delta lobe, or a
 * density above SHARP_PDF (transport/photons/weight.cl). */
#define RIVAL_MOST 1e18f /* so that its square is finite */

inline real rival_limited(real rival) { return min_r(rival, (real)(RIVAL_MOST)); }

/* Whether light paths end at a vertex: what happens there is not the same for light that comes the other way. */
inline mask rival_ends(Scene scene, Vertex v)
{
    return BSDF_ENDS_LIGHT_PATHS ? mask_of(1) : shading_frame_turns(scene, v.row);
}

/* What a vertex knows of the rival of its path. */
typedef struct {
    real arrives; /* rival / c, with importance and emission */
    real found;   /* of a light path's first vertex, q */
    mask first;   /* it is the path's first vertex */
    mask met;     /* a ray from it might meet the light */
    real pending; /* what joins `arrives` where the vertex is sharp; of a light path, at the joint alone */
    real merges;  /* what merging here has over the path's density: 0 where there is none */
} Rival;

#include "generated/rival_dull.cl"
#include "generated/rival_steps.cl"

/* Of a camera's path. sampler: of its sample. */
inline Rival rival_of_camera(Scene scene, Slab path, uint at, Vertex v, Sampler sampler)
{
    Rival r;
    real rival = load_path_rival(path, at);
    r.first = v.depth == 0;
    r.met = mask_of(1);
    r.found = 0.0f;
    if (any(r.first)) rival = sel(r.first, rival_seen(scene, v, sampler, rival), rival);
    real goes_on = sel(rival_ends(scene, v), (real)(0.0f), 1.0f / max_r(VERTEX_COSINE(v.s.n, v.d), (real)(1e-7f)));
    r.arrives = rival * goes_on;
    r.pending = load_path_pending(path, at) * goes_on;
    r.merges = rival_merges_here(scene, path, at, v);
    return r;
}

/* Whether a ray may meet a row of `lights`. */
inline mask rival_light_met(Scene scene, integer row)
{
    mask shape = (light_at(scene, row).shape >= 0) & light_shows(scene, row, mask_of(1));
    return (row < scene.settings->infinite_count) | shape;
}

/* The density of a light path that comes from a point of a light. It is asked for before the material is: what it needs
 * on the way and what the material keeps would be too many of a GPU's registers. */
inline real event_begins(Scene scene, Surface s, LightSample ls)
{
    return light_path_pdf(scene, ls.row, s.p, ls.wi, ls.t, ls.n);
}

/* Over the density of next-event estimation, that of a light path along wi, which `begins` with such a density, where
 * the material has densities p and p_back. */
inline real rival_of_light_sample(Scene scene, Rival r, Surface s, LightSample ls, real begins, real p, real p_back)
{
    real chosen = sel(ls.pdf < 0.0f, ls.chance, ls.pdf);
    real emission = begins / max_r(chosen, (real)(1e-30f));
    real arrives = rival_arrives(r, mask_of(0), p, p_back) * VERTEX_COSINE(s.n, ls.wi) * emission;
    real third = rival_of_dull(rival_limited(arrives * p_back), p);
    real joined = 0.0f;
    if (BSDF_IS_PHASE) joined = sel(rival_light_met(scene, ls.row), (real)(0.0f), rival_limited(arrives));
    return sel(r.first, joined, third);
}

/* Along a camera's path that goes on along d, with density p; delta: by a delta lobe. */
inline real rival_to_light(Rival r, Surface s, vec3 d, mask delta, real p, real p_back)
{
    real scatters = sel(r.first, (real)(1.0f), p_back) / max_r(p, (real)(1e-30f));
    real change = sel(delta, sel(r.first, (real)(0.0f), (real)(1.0f)), scatters);
    return rival_limited(rival_arrives(r, delta, p, p_back) * change * VERTEX_COSINE(s.n, d));
}

/* Of a light path. receiver: by which a camera's path would choose a light here. */
inline Rival rival_of_emission(Scene scene, Slab path, uint at, Vertex v, Receiver receiver)
{
    Rival r;
    r.arrives = load_path_rival(path, at) / max_r(VERTEX_COSINE(v.s.n, v.d), (real)(1e-7f));
    r.first = v.depth == 1;
    r.met = mask_of(1);
    r.found = 0.0f;
    if (any(r.first)) {
        integer row = sel_i(r.first, load_path_light(path, at), (integer)(0));
        vec3 wi = neg3(v.d), n = load_path_sampled_hemisphere(path, at);
        real t = v.t + load_path_null_distance(path, at);
        real emission = common_light_begins_pdf(scene, row, v.s.p, receiver, wi, t, n, &r.found);
        r.arrives = r.arrives / sel(r.first, max_r(emission, (real)(1e-30f)), (real)(1.0f));
        r.met = !r.first | rival_light_met(scene, row);
    }
    r.pending = load_path_pending(path, at) / max_r(VERTEX_COSINE(v.s.n, v.d), (real)(1e-7f));
    r.merges = rival_left_here(scene, path, at, v);
    return r;
}

/* Along a light path that goes on along d, with density p. */
inline real rival_to_camera(Rival r, Surface s, vec3 d, mask delta, real p, real p_back)
{
    real back = sel(r.met, p_back, (real)(0.0f));
    real either = sel(r.first, sqrt(sqr(back) + sqr(r.found)), back) / max_r(p, (real)(1e-30f));
    real change = sel(delta, sel(r.met, (real)(1.0f), (real)(0.0f)), either);
    return rival_limited(r.arrives * change * VERTEX_COSINE(s.n, d));
}

/* The square of the rival of a light path that is joined to the camera, where the material has densities p and p_back
 * of a camera's path. */
inline real rival_of_joint(Scene scene, Rival r, Surface s, CameraPoint c, real p, real p_back)
{
    real importance = c.importance * scene.settings->rival_area, chosen = 1.0f / max_r(importance, (real)(1e-30f));
    real square = sqr(rival_to_camera(r, s, c.d, mask_of(0), chosen, p));
    return square + rival_merged_square(r, s, c.d, importance, p, p_back);
}

/* What a point of a light counts that next-event estimation has chosen; p: guide's and material's density of it. */
#define event_weight(scene, rival, s, ls, begins, pair, p) rival_event_weight(scene, rival, s, ls, begins, pair)
inline real rival_event_weight(Scene scene, Rival r, Surface s, LightSample ls, real begins, BsdfPair pair)
{
    real third = rival_of_light_sample(scene, r, s, ls, begins, pair.p, pair.p_back);
    return mis_weight_of_three(ls.pdf, pair.p, third);
}

/* What a camera's path keeps that `scatters` along `onward`. Returns the density of that direction. */
inline real rival_goes_to_light(Slab path, uint at, mask scatters, Rival r, Vertex *v, vec3 onward, mask delta,
                                BsdfSample bs)
{
    store_path_rival(path, at, scatters, rival_to_light(r, v->s, onward, delta, bs.p, bs.p_back));
    rival_pends_to_light(path, at, scatters, r, v, onward, delta, bs.p, bs.p_back);
    return bs.p;
}

/* What a light path keeps that goes on along `onward`. Returns which do. */
inline mask rival_goes_to_camera(Scene scene, Slab path, uint at, mask next, mask null, Rival r, Vertex *v, vec3 onward,
                                 BsdfSample bs)
{
    next = next & !rival_ends(scene, *v);
    mask delta = (bs.lobe & LOBE_DELTA) != 0;
    store_path_rival(path, at, next & !null, rival_to_camera(r, v->s, onward, delta, bs.p, bs.p_back));
    rival_pends_to_camera(path, at, next & !null, null, r, v, onward, delta, bs.p, bs.p_back);
    return next;
}

/* What the joint of a light path to the camera counts; leaves in `shine` those that are not left to the camera. */
inline real rival_joint(Scene scene, Rival r, Vertex v, BsdfPair pair, CameraPoint c, mask *shine)
{
    mask hidden = mask_of(scene.settings->hide_lights != 0) & (v.s.light >= 0);
    mask joined = BSDF_IS_PHASE ? !r.first | !r.met : !r.first;
    *shine = *shine & joined & !hidden & !rival_ends(scene, v);
    return 1.0f / (1.0f + rival_of_joint(scene, r, v.s, c, pair.p, pair.p_back));
}

/* Twin, where paths are not weighed against light paths. */
typedef integer Rival;
#define rival_of_camera(scene, path, at, v, sampler) ((integer)(0))
#define rival_of_emission(scene, path, at, v, receiver) ((integer)(0))
#define event_begins(scene, s, ls) ((real)(0.0f))
#define event_weight(scene, rival, s, ls, begins, pair, p) \
    sel((ls).pdf < 0.0f, (real)(1.0f), mis_weight((ls).pdf, p))
#define rival_goes_to_light(path, at, scatters, rival, v, onward, delta, bs) ((bs).pdf)
#define rival_goes_to_camera(scene, path, at, next, null, rival, v, onward, bs) (next)
#define rival_joint(scene, rival, v, pair, c, shine) ((real)(1.0f))
