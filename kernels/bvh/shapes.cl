/* Rays and a tree over shapes that the caller keeps: spheres, disks, cylinders.
 *
 * Before this file the includer defines the type ShapeTable and
 *     int shape_intersect(ShapeTable table, uint prim, float3 o, float3 d, float tmin, float *t)
 * which returns 1 and lowers *t if the ray meets shape `prim` between tmin and *t. `shapes_trace` returns the nearest
 * shape, or with `first_only` any; BVH_MISS without a hit. *t starts as the farthest distance. `indices`: the shape of
 * each leaf's item.
 */

/* Step binary: in a binary tree. A popped node's box is tested again, since its memory is read anyway: so a level takes
 * 4 bytes of the stack. */
#include "bvh/ray.cl"

inline uint shapes_trace(global const float *nodes, global const uint *indices, ShapeTable table, float3 o,
                         float3 d, float tmin, float *t, int first_only)
{
    if (!ray_finite(o.x, o.y, o.z, d.x, d.y, d.z)) return BVH_MISS;
    Ray ray = ray_make(o.x, o.y, o.z, d.x, d.y, d.z, tmin);
    global const float8 *tree = (global const float8 *)nodes;
    uint waiting[BVH_SHAPES_DEPTH], n = 0, found = BVH_MISS, at = 0;
    if (ray_enter(&ray, tree[0], *t) == INFINITY) return BVH_MISS;
    for (;;) {
        float8 node = tree[at];
        uint link = node_link(node);
        if (node_is_leaf(node)) {
            for (uint i = link; i < link + node_count(node); i++)
                if (shape_intersect(table, indices[i], o, d, tmin, t)) found = indices[i];
            if (first_only && found != BVH_MISS) n = 0; /* no return: see compact_end */
        } else {
            float left = ray_enter(&ray, tree[link], *t), right = ray_enter(&ray, tree[link + 1], *t);
            float near = ray_min(left, right), far = ray_max(left, right);
            if (near < INFINITY) {
                uint nearer = left <= right ? 0 : 1;
                at = link + nearer;
                if (far < INFINITY) waiting[n++] = link + 1 - nearer;
                continue;
            }
        }
        do {
            if (!n) return found;
            at = waiting[--n];
        } while (ray_enter(&ray, tree[at], *t) == INFINITY);
    }
}

/* Step wide8: in an 8-wide tree. A leaf is a shape, whose box was tested together with seven neighbours. */
#include "bvh/wide8.cl"

inline uint shapes_trace(global const float *nodes, global const uint *indices, ShapeTable table, float3 o,
                         float3 d, float tmin, float *t, int first_only)
{
    if (!ray_finite(o.x, o.y, o.z, d.x, d.y, d.z)) return BVH_MISS;
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
