/* Traversal of an 8-wide tree over shapes: see bvh/shapes.cl. A leaf is a shape, whose box was tested together with
 * seven neighbours. */
#include "bvh/wide8.cl"

inline uint shapes_trace(global const float *nodes, global const uint *indices, ShapeTable table, float3 o,
                         float3 d, float tmin, float *t, int first_only)
{
    Wide8Ray ray = wide8_ray(o.x, o.y, o.z, d.x, d.y, d.z, tmin);
    ulong waiting[WIDE8_STACK];
    uint n = 0, at = 0, found = BVH_MISS;
    do {
        at = wide8_descend(nodes, &ray, *t, at, waiting, &n);
        if (!(at & BVH_LEAF)) continue;
        uint prim = indices[at & ~BVH_LEAF];
        if (!shape_intersect(table, prim, o, d, tmin, t)) continue;
        found = prim;
        if (first_only) return found;
    } while (wide8_next(nodes, &ray, waiting, &n, *t, &at));
    return found;
}
