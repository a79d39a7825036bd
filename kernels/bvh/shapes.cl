/* Traversal of a binary tree over shapes that the caller keeps: spheres, disks, cylinders.
 *
 * Before this file the includer defines the type ShapeTable and
 *     int shape_intersect(ShapeTable table, uint prim, const Ray *ray, float *t)
 * which returns 1 and lowers *t if the ray meets shape `prim` between ray->tmin and *t. (bvh/ray.cl
 * declares Ray.) `indices` are those of bvh/pack.cl.
 */
#include "bvh/hit.cl"
#include "bvh/ray.cl"

/* The nearest shape, or with `first_only` any; BVH_MISS if none. *t begins as the farthest allowed. What waits is a
 * node with where the ray enters it, so that each box is tested once. */
inline uint shapes_trace(global const float *nodes, global const uint *indices, ShapeTable table,
                         const Ray *ray, float *t, int first_only)
{
    global const float8 *tree = (global const float8 *)nodes;
    uint waiting[BVH_DEPTH + 1], n = 0, found = BVH_MISS, at = 0;
    float entry[BVH_DEPTH + 1];
    if (ray_enter(ray, tree[0], *t) == INFINITY) return BVH_MISS;
    for (;;) {
        float8 node = tree[at];
        uint link = node_link(node);
        if (node_is_leaf(node)) {
            for (uint i = link; i < link + node_count(node); i++)
                if (shape_intersect(table, indices[i], ray, t)) found = indices[i];
            if (first_only && found != BVH_MISS) return found;
        } else {
            float left = ray_enter(ray, tree[link], *t), right = ray_enter(ray, tree[link + 1], *t);
            float near = ray_min(left, right), far = ray_max(left, right);
            if (near < INFINITY) {
                uint nearer = left <= right ? 0 : 1;
                at = link + nearer;
                if (far < INFINITY) {
                    waiting[n] = link + 1 - nearer;
                    entry[n++] = far;
                }
                continue;
            }
        }
        do {
            if (!n) return found;
            at = waiting[--n];
        } while (entry[n] > *t);
    }
}

inline uint shapes_closest(global const float *nodes, global const uint *indices, ShapeTable table,
                           float ox, float oy, float oz, float dx, float dy, float dz, float tmin,
                           float *t)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return BVH_MISS;
    Ray ray = ray_make(ox, oy, oz, dx, dy, dz, tmin);
    return shapes_trace(nodes, indices, table, &ray, t, 0);
}

inline int shapes_occluded(global const float *nodes, global const uint *indices, ShapeTable table,
                           float ox, float oy, float oz, float dx, float dy, float dz, float tmin,
                           float tmax)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return 0;
    Ray ray = ray_make(ox, oy, oz, dx, dy, dz, tmin);
    return shapes_trace(nodes, indices, table, &ray, &tmax, 1) != BVH_MISS;
}
