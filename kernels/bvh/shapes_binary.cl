/* Traversal of a binary tree over shapes: see bvh/shapes.cl. A popped node's box is tested again, since its memory is
 * read anyway: so a level takes 4 bytes of the stack. */
#include "bvh/hit.cl"
#include "bvh/ray.cl"

inline uint shapes_trace(global const float *nodes, global const uint *indices, ShapeTable table, float3 o,
                         float3 d, float tmin, float *t, int first_only)
{
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
