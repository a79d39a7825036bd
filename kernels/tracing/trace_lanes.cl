/* Tracing in lanes: every triangle and every analytic shape against all rays of the work-item. */
#include "tracing/trace.cl"
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
