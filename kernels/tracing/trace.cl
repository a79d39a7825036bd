/* Queries of the intersect and shadow stages in lane types: `trace_closest` and `trace_occluded`. A ray begins off its
 * surface, so tmin is 0. */

/* A ray's hit. */
typedef struct {
    real t, u, v;  /* FAR and beyond: nothing */
    vec3 n;        /* see Hit.n in clpt/records */
    real plane, side; /* see Hit there; 0 off triangles */
    integer prim;  /* -1: nothing */
    integer shape; /* row in `shapes` */
#if USES_INSTANCES
    integer instance; /* see Hit.instance in clpt/records */
#endif
} TraceHit;

/* Step lanes: every triangle and every analytic shape against all rays of the work-item. */
#include "bvh/brute.cl"
#include "generated/shape_tree.cl"
#include "generated/trace_args.cl"

inline TraceHit trace_closest(TRACE_ARGS, Scene scene, vec3 o, vec3 d, real far, mask active)
{
    BruteHit b = brute_closest(tris, triangles, o, d, (real)(0.0f), far, active);
    TraceHit h = {b.t, b.u, b.v, b.n, b.plane, b.side, as_integer(b.prim), as_integer(b.tag)};
#if USES_ANALYTIC
    for (int i = 0; i < scene.settings->analytic_count; i++) {
        int row = shape_row_of(scene, i);
        ShapeHit s = shape_hit(scene, i, row, o, d, (real)(0.0f), h.t);
        mask nearer = active & (s.t < h.t);
        h.t = sel(nearer, s.t, h.t);
        h.u = sel(nearer, s.uv.x, h.u);
        h.v = sel(nearer, s.uv.y, h.v);
        h.n = sel3(nearer, s.n, h.n);
        h.prim = sel_i(nearer, (integer)(i), h.prim);
        h.shape = sel_i(nearer, (integer)(row), h.shape);
    }
#endif
    return h;
}

inline mask trace_occluded(TRACE_ARGS, Scene scene, vec3 o, vec3 d, real t, mask active)
{
    mask met = brute_occluded(tris, triangles, o, d, (real)(0.0f), t, active);
#if USES_ANALYTIC
    for (int i = 0; i < scene.settings->analytic_count && any(active & !met); i++) {
        ShapeHit s = shape_hit(scene, i, shape_row_like(scene, i), o, d, (real)(0.0f), t);
        met = met | (active & (s.t < t));
    }
#endif
    return met;
}

/* Step single: a ray a work-item: triangles through LAYOUT(verb), analytic shapes through bvh/shapes.cl. */
#include "generated/layout.cl"
#include "generated/trace_args.cl"
#include "generated/shape_tree.cl"

/* The tree over analytic shapes, for tracing with a ray a work-item. */
typedef Scene ShapeTable;
inline int shape_intersect(Scene scene, uint prim, float3 from, float3 along, float tmin, float *t)
{
    vec3 o = {from.x, from.y, from.z}, d = {along.x, along.y, along.z};
    ShapeHit hit = shape_hit(scene, (int)prim, shape_row_like(scene, (int)prim), o, d, tmin, *t);
    if (!(hit.t < *t)) return 0;
    *t = hit.t;
    return 1;
}

#include "generated/shape_traversal.cl"
#include "generated/instance_traversal.cl"

/* The nearest shape before *t, which becomes its distance, or any with `first_only`; BVH_MISS without a hit. */
inline uint trace_shapes(TRACE_ARGS, Scene scene, vec3 o, vec3 d, real *t, int first_only)
{
    float3 from = (float3)(o.x, o.y, o.z), along = (float3)(d.x, d.y, d.z);
    return shapes_trace(shape_nodes, shape_indices, scene, from, along, 0.0f, t, first_only);
}

inline TraceHit trace_closest(TRACE_ARGS, Scene scene, vec3 o, vec3 d, real far, mask active)
{
#if ONLY_INSTANCES
    TriHit t = tri_miss(far);
#else
    TriHit t = LAYOUT(closest)(nodes, leaves, o.x, o.y, o.z, d.x, d.y, d.z, 0.0f, far);
#endif
    TraceHit h = {t.t, t.u, t.v, {t.nx, t.ny, t.nz}, t.plane, t.side, as_int(t.prim), as_int(t.tag)};
#if USES_INSTANCES
    instances_closest(nodes, leaves, instance_nodes, scene, o, d, t, &h);
#endif
#if USES_ANALYTIC
    uint shape = trace_shapes(TRACE_PASSED, scene, o, d, &h.t, 0);
    if (shape != BVH_MISS) {
        int prim = as_int(shape), row = shape_row_of(scene, prim);
        ShapeHit s = shape_hit(scene, prim, row, o, d, 0.0f, FAR);
        TraceHit met = {h.t, s.uv.x, s.uv.y, s.n, h.plane, h.side, prim, row}; /* of no instance */
        h = met;
    }
#endif
    return h;
}

inline mask trace_occluded(TRACE_ARGS, Scene scene, vec3 o, vec3 d, real t, mask active)
{
#if !ONLY_INSTANCES
    if (LAYOUT(occluded)(nodes, leaves, o.x, o.y, o.z, d.x, d.y, d.z, 0.0f, t)) return 1;
#endif
#if USES_INSTANCES
    if (instances_occluded(nodes, leaves, instance_nodes, scene, o, d, t)) return 1;
#endif
#if USES_ANALYTIC
    return trace_shapes(TRACE_PASSED, scene, o, d, &t, 1) != BVH_MISS;
#else
    return 0;
#endif
}

/* Step each: the rays of a work-item's lanes and their ends, for sequential tracing: `at[i]` belongs to lane i. */
#include "bvh/ray.cl"
typedef union { real v; float at[LANES]; } TraceReal;
typedef union { integer v; int at[LANES]; } TraceInteger;
typedef struct { TraceReal ox, oy, oz, dx, dy, dz, t; } TraceRays;
typedef struct { TraceReal t, u, v, nx, ny, nz, plane, side; TraceInteger prim, tag; } TraceHits;
#define TRACE_RAY(r, i) (r)->ox.at[i], (r)->oy.at[i], (r)->oz.at[i], (r)->dx.at[i], (r)->dy.at[i], \
                        (r)->dz.at[i], 0.0f, (r)->t.at[i]

inline TraceRays trace_rays(vec3 o, vec3 d, real far)
{
    return (TraceRays){{o.x}, {o.y}, {o.z}, {d.x}, {d.y}, {d.z}, {far}};
}

/* The lanes with a ray, in order, and their number. */
inline uint trace_active(mask active, uint *rays)
{
    TraceInteger is = {active};
    uint n = 0;
    for (uint i = 0; i < LANES; i++)
        if (is.at[i]) rays[n++] = i;
    return n;
}

inline TraceHits trace_missed(real far)
{
    TraceReal none = {(real)(0.0f)};
    return (TraceHits){{far}, none, none, none, none, none, none, none, {(integer)(-1)}, {(integer)(0)}};
}

inline void trace_put(TraceHits *h, uint i, TriHit hit)
{
    h->t.at[i] = hit.t;
    h->u.at[i] = hit.u;
    h->v.at[i] = hit.v;
    h->nx.at[i] = hit.nx;
    h->ny.at[i] = hit.ny;
    h->nz.at[i] = hit.nz;
    h->plane.at[i] = hit.plane;
    h->side.at[i] = hit.side;
    h->prim.at[i] = as_int(hit.prim);
    h->tag.at[i] = as_int(hit.tag);
}

inline TraceHit trace_together(TraceHits h)
{
    return (TraceHit){h.t.v, h.u.v, h.v.v, {h.nx.v, h.ny.v, h.nz.v}, h.plane.v, h.side.v, h.prim.v, h.tag.v};
}

/* Step interleaved: the rays of a work-item in turn through the 8-wide tree, where trees of triangles are larger than a
 * processor's caches; for `intersect` only. Coherent rays are traced sequentially: see bvh/query.cl. */
#include "bvh/wide8.cl#interleaved"
#include "generated/trace_args.cl"
#include "tracing/trace.cl#each"

/* Whether three quarters of the rays have about their predecessor's direction. */
inline int trace_alike(const TraceRays *r, const uint *rays, uint count)
{
    uint alike = 0;
    for (uint k = 1; k < count; k++) {
        uint i = rays[k - 1], j = rays[k];
        alike += wide8_alike((float3)(r->dx.at[i], r->dy.at[i], r->dz.at[i]),
                             (float3)(r->dx.at[j], r->dy.at[j], r->dz.at[j]));
    }
    return 4 * alike + 3 >= 3 * count;
}

/* Steps every ray in turn, until all have finished. */
inline void trace_step_all(global const float *nodes, global const float *leaves, const TraceRays *r, uint *rays,
                           uint active, TraceHits *h)
{
    Wide8RayState states[LANES];
    for (int started = 0; active; started = 1) {
        uint left = 0;
        for (uint k = 0; k < active; k++) {
            uint i = rays[k];
            Wide8RayState *s = states + i;
            int goes = started || wide8_start(s, TRACE_RAY(r, i));
            if (goes && wide8_step(nodes, leaves, s))
                rays[left++] = i;
            else
                trace_put(h, i, wide8_finish(leaves, s));
        }
        active = left;
    }
}

inline TraceHit trace_closest(TRACE_ARGS, Scene scene, vec3 o, vec3 d, real far, mask active)
{
    TraceHits h = trace_missed(far);
    TraceRays r = trace_rays(o, d, far);
    uint rays[LANES], count = trace_active(active, rays);
    if (!trace_alike(&r, rays, count)) {
        trace_step_all(nodes, leaves, &r, rays, count, &h);
    } else {
        for (uint k = 0; k < count; k++)
            trace_put(&h, rays[k], wide8_closest(nodes, leaves, TRACE_RAY(&r, rays[k])));
    }
    return trace_together(h);
}
