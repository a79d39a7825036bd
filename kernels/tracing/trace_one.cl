/* Tracing with a ray a work-item: triangles through LAYOUT(verb), analytic shapes through bvh/shapes.cl. */
#include "tracing/trace.cl"
#include "generated/layout.cl"
#include "generated/trace_args.cl"
#include "generated/shape_tree.cl"
#include "tracing/trace_shapes.cl"
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
