/* Tracing in scenes with curves. */

/* Whether a ray passes beside a piece of a curve: all control points are farther to the same side than its radius. Most
 * pieces with hit boxes are rejected here, four points at a time. `piece`: its words, see
 * kernels/shapes/kinds/curves.cl. */
inline int curve_beside(global const float *piece, float3 o, float3 d)
{
    float4 x = vload4(0, piece) - o.x, y = vload4(1, piece) - o.y, z = vload4(2, piece) - o.z;
    float4 r = fabs(vload4(3, piece));
    float3 chord = (float3)(x.w - x.x, y.w - y.x, z.w - z.x);
    float nx = chord.y * d.z - chord.z * d.y, ny = chord.z * d.x - chord.x * d.z, nz = chord.x * d.y - chord.y * d.x;
    float4 w = x * nx + y * ny + z * nz, away = fabs(x) + fabs(y) + fabs(z);
    float2 half_reach = fmax(r.lo, r.hi), half_away = fmax(away.lo, away.hi);
    float reach = fmax(half_reach.x, half_reach.y) + 1e-6f * fmax(half_away.x, half_away.y); /* and rounding errors */
    float limit = reach * reach * (nx * nx + ny * ny + nz * nz);
    return all((w * w > limit) & (w > 0.0f)) || all((w * w > limit) & (w < 0.0f));
}

/* The same for tracing with a ray a work-item; in lanes the test is skipped. */
#if LANES == 1
#define curve_beside_one(piece, o, d) curve_beside(piece, (float3)(o.x, o.y, o.z), (float3)(d.x, d.y, d.z))
#else
#define curve_beside_one(piece, o, d) 0
#endif

/* Step others: hits of few other shapes beside curves, such as a spherical lamp: each is tested against all lanes. */
#include "generated/shape_tree.cl"
#define CURVE_OTHERS scene.settings->single_count /* primitives below are not curves */

/* Adds to `hit` the active lanes' hits before t of primitives that are not curves. */
inline ShapeHit curve_others(Scene scene, integer prim, mask active, vec3 o, vec3 d, real t, ShapeHit hit)
{
    TraceInteger prims = {prim}, left = {active & (prim < CURVE_OTHERS)};
    for (uint i = 0; i < LANES; i++) {
        if (!left.at[i]) continue;
        int shape = prims.at[i];
        ShapeHit own = shape_hit(scene, shape, shape_row_like(scene, shape), o, d, (real)(0.0f), t);
        mask same = (left.v != 0) & (prim == shape);
        hit.t = sel(same, own.t, hit.t);
        hit.n = sel3(same, own.n, hit.n);
        hit.uv.x = sel(same, own.uv.x, hit.uv.x);
        hit.uv.y = sel(same, own.uv.y, hit.uv.y);
        left.v = sel_i(same, (integer)(0), left.v);
    }
    return hit;
}

/* Twin, where there are none. */
inline ShapeHit curve_others(Scene scene, integer prim, mask active, vec3 o, vec3 d, real t, ShapeHit hit)
{
    return hit;
}
#define CURVE_OTHERS 0

/* Step interleaved: a work-item's rays in scenes with curves, triangles and few other shapes. Rays step in turn from
 * node to node of the tree over pieces, with prefetches, until each reaches a piece that it does not pass beside, or
 * ends. Then these pieces are tested in lanes. Triangles are traced before, ray by ray. Hits equal the hits of
 * tracing/trace.cl's step `single` to the bit. */
#include "tracing/trace.cl"
#include "generated/layout.cl"
#include "generated/trace_args.cl"
#include "bvh/hints.cl"
#include "generated/shape/curves.cl"
#include "tracing/shape_rows.cl#many"
#include "tracing/trace.cl#each"
#include "generated/curve_others.cl"

typedef struct {
    Wide8Ray ray;
    float3 o, d;
    float t;
    uint at, waits; /* at: a node, or a leaf */
    int piece;      /* of the leaf */
    ulong waiting[WIDE8_STACK];
} CurveRay;

typedef struct { global const float *nodes; global const uint *indices; global const float *pieces; } CurveTree;

/* The row in `shapes` of the first curves, and the address of primitive 0 if it were a piece: pieces are consecutive,
 * shape by shape. */
inline integer curve_row_first(Scene scene)
{
    return (integer)((scene.settings->first_analytic + scene.settings->single_count) * SHAPE_ROW_WORDS);
}

inline CurveTree curve_tree(global const float *nodes, global const uint *indices, Scene scene)
{
    ShapeRow row = shape_row_row(scene.shapes, curve_row_first(scene));
    TraceInteger first = {curve_row(scene.geometry, row.params).first};
    return (CurveTree){nodes, indices, scene.spheres + first.at[0]};
}

/* Move a ray to a node or a leaf, and fetch its memory. */
inline void curve_ray_visit(CurveTree tree, CurveRay *r, uint at)
{
    r->at = at;
    if (at & BVH_LEAF) {
        r->piece = (int)tree.indices[at & ~BVH_LEAF];
        FETCH(tree.pieces + CURVE_WORDS * r->piece);
        FETCH(tree.pieces + CURVE_WORDS * r->piece + 15);
    } else {
        for (uint line = 0; line < 4; line++) FETCH(tree.nodes + (ulong)at * 64 + 16 * line);
    }
}

/* Pop the next node or leaf; return 0 at the end. */
inline int curve_ray_next(CurveTree tree, CurveRay *r)
{
    uint at;
    if (!wide8_later(tree.nodes, r->waiting, &r->waits, r->t, &at)) return 0;
    curve_ray_visit(tree, r, at);
    return 1;
}

/* Take a step; return 0 at the end. */
inline int curve_ray_step(CurveTree tree, CurveRay *r)
{
    if (r->at & BVH_LEAF) return curve_ray_next(tree, r);
    union { float8 v; uint at[8]; } entry;
    Mask8 m = wide8_boxes(tree.nodes + (ulong)r->at * 64, &r->ray, r->t, &entry.v);
    if (!m) return curve_ray_next(tree, r);
    curve_ray_visit(tree, r, wide8_nearest(tree.nodes, r->at, entry.at, m, r->waiting, &r->waits));
    return 1;
}

/* Whether a ray is at a piece or another shape that it may hit. */
inline int curve_ray_waits(CurveTree tree, Scene scene, const CurveRay *r)
{
    if (!(r->at & BVH_LEAF)) return 0;
    return r->piece < CURVE_OTHERS || !curve_beside(tree.pieces + CURVE_WORDS * r->piece, r->o, r->d);
}

/* Start the finite active rays; return their number. */
inline uint curve_rays_start(const TraceRays *rays, CurveRay *states, mask active, uint *going)
{
    uint begun[LANES], count = trace_active(active, begun), n = 0;
    for (uint k = 0; k < count; k++) {
        uint i = begun[k];
        CurveRay *r = states + i;
        r->o = (float3)(rays->ox.at[i], rays->oy.at[i], rays->oz.at[i]);
        r->d = (float3)(rays->dx.at[i], rays->dy.at[i], rays->dz.at[i]);
        if (!ray_finite(r->o.x, r->o.y, r->o.z, r->d.x, r->d.y, r->d.z)) continue;
        r->ray = wide8_ray(r->o.x, r->o.y, r->o.z, r->d.x, r->d.y, r->d.z, 0.0f);
        r->t = rays->t.at[i];
        r->at = r->waits = 0;
        going[n++] = i;
    }
    return n;
}

/* The nearest primitive of each active ray before *t, or any with `first_only`; -1 without a hit. *t becomes its
 * distance. */
inline integer curves_trace(CurveTree tree, Scene scene, vec3 o, vec3 d, mask active, int first_only, real *t)
{
    CurveRay states[LANES];
    TraceRays rays = trace_rays(o, d, *t);
    TraceInteger piece = {(integer)(0)};
    integer best = -1, params = shape_row_row(scene.shapes, curve_row_first(scene)).params;
    uint going[LANES], count = curve_rays_start(&rays, states, active, going);
    while (count) {
        TraceInteger tests = {(integer)(0)};
        uint waiting[LANES], waits = 0;
        while (count) {
            uint left = 0;
            for (uint k = 0; k < count; k++) {
                uint i = going[k];
                if (curve_ray_waits(tree, scene, states + i)) {
                    piece.at[i] = states[i].piece;
                    tests.at[i] = -1;
                    waiting[waits++] = i;
                } else if (curve_ray_step(tree, states + i)) {
                    going[left++] = i;
                }
            }
            count = left;
        }
        if (!waits) break;
        mask tested = tests.v != 0;
        Curve q = curves_one(scene, params, piece.v, tested & (piece.v >= CURVE_OTHERS));
        ShapeHit hit = curve_intersect(q, o, d, (real)(0.0f), rays.t.v);
        hit = curve_others(scene, piece.v, tested, o, d, rays.t.v, hit);
        mask met = tested & (hit.t < rays.t.v);
        rays.t.v = sel(met, hit.t, rays.t.v);
        best = sel_i(met, piece.v, best);
        TraceInteger ends = {met & mask_of(first_only)};
        for (uint k = 0; k < waits; k++) {
            uint i = waiting[k];
            states[i].t = rays.t.at[i];
            if (!ends.at[i] && curve_ray_next(tree, states + i)) going[count++] = i;
        }
    }
    *t = rays.t.v;
    return best;
}

inline TraceHit trace_closest(TRACE_ARGS, Scene scene, vec3 o, vec3 d, real far, mask active)
{
    TraceHits hits = trace_missed(far);
    TraceRays r = trace_rays(o, d, far);
    uint rays[LANES], count = trace_active(active, rays);
    for (uint k = 0; k < count; k++)
        trace_put(&hits, rays[k], LAYOUT(closest)(nodes, leaves, TRACE_RAY(&r, rays[k])));
    TraceHit h = trace_together(hits);
    integer piece = curves_trace(curve_tree(shape_nodes, shape_indices, scene), scene, o, d, active, 0, &h.t);
    mask met = piece >= 0;
    if (!any(met)) return h;
    TraceInteger of = {piece}, shape = {h.shape};
    for (uint k = 0; k < count; k++)
        if (of.at[rays[k]] >= 0) shape.at[rays[k]] = shape_row_of(scene, of.at[rays[k]]);
    h.shape = shape.v;
    h.prim = sel_i(met, piece, h.prim);
    mask curved = met & (piece >= CURVE_OTHERS);
    integer row = sel_i(curved, h.shape * SHAPE_ROW_WORDS, curve_row_first(scene));
    Curve q = curves_one(scene, shape_row_row(scene.shapes, row).params, piece, curved);
    ShapeHit s = curve_intersect(q, o, d, (real)(0.0f), (real)(FAR));
    s = curve_others(scene, piece, met, o, d, (real)(FAR), s);
    h.n = sel3(met, s.n, h.n);
    h.u = sel(met, s.uv.x, h.u);
    h.v = sel(met, s.uv.y, h.v);
    return h;
}

inline mask trace_occluded(TRACE_ARGS, Scene scene, vec3 o, vec3 d, real t, mask active)
{
    TraceRays r = trace_rays(o, d, t);
    TraceInteger blocked = {(integer)(0)};
    uint rays[LANES], count = trace_active(active, rays);
    for (uint k = 0; k < count; k++)
        if (LAYOUT(occluded)(nodes, leaves, TRACE_RAY(&r, rays[k]))) blocked.at[rays[k]] = -1;
    mask behind = blocked.v != 0;
    CurveTree tree = curve_tree(shape_nodes, shape_indices, scene);
    return behind | (curves_trace(tree, scene, o, d, active & !behind, 1, &t) >= 0);
}
