/* Traversal of the binary tree that build.cl makes, one ray a work-item: the readable reference, and
 * the layout for GPUs. `leaves` holds the triangle records of leaves.cl.
 */
#include "bvh/triangle.cl"

/* The corners of the box around everything. */
inline void binary_bounds(global const float *nodes, float3 *low, float3 *high)
{
    float8 root = *(global const float8 *)nodes;
    *low = root.s012;
    *high = root.s456;
}

/* The nearest hit, or with `first_only` any. */
inline TriHit binary_trace(global const float *nodes, global const float *leaves, Ray ray, float tmax,
                           int first_only)
{
    Shear shear = shear_make(ray.o.x, ray.o.y, ray.o.z, ray.d.x, ray.d.y, ray.d.z);
    global const float8 *tree = (global const float8 *)nodes;
    uint waiting[BVH_DEPTH];
    float entries[BVH_DEPTH];
    uint n = 0;
    TriHit hit = tri_miss(tmax);
    float8 node = tree[0];
    float entry = ray_enter(&ray, node, hit.t);
    for (;;) {
        if (entry < INFINITY && !node_is_leaf(node)) {
            uint left = node_link(node);
            float8 other = tree[left + 1];
            node = tree[left];
            entry = ray_enter(&ray, node, hit.t);
            float other_entry = ray_enter(&ray, other, hit.t);
            if (fmax(entry, other_entry) < INFINITY) { /* both: the farther one waits */
                waiting[n] = left + (other_entry >= entry);
                entries[n++] = fmax(entry, other_entry);
            }
            if (other_entry < entry) {
                node = other;
                entry = other_entry;
            }
            continue;
        }
        if (entry < INFINITY) {
            uint begin = node_link(node), end = begin + node_count(node);
            for (uint i = begin; i < end; i++)
                triangle_intersect(leaves + (ulong)i * 16, &shear, ray.tmin, &hit);
            if (first_only && hit.prim != BVH_MISS) return hit;
        }
        do {
            if (!n) return hit;
            entry = entries[--n];
        } while (entry >= hit.t);
        node = tree[waiting[n]];
    }
}

inline TriHit binary_closest(global const float *nodes, global const float *leaves, float ox, float oy,
                             float oz, float dx, float dy, float dz, float tmin, float tmax)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return tri_miss(tmax);
    return binary_trace(nodes, leaves, ray_make(ox, oy, oz, dx, dy, dz, tmin), tmax, 0);
}

inline int binary_occluded(global const float *nodes, global const float *leaves, float ox, float oy,
                           float oz, float dx, float dy, float dz, float tmin, float tmax)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return 0;
    Ray ray = ray_make(ox, oy, oz, dx, dy, dz, tmin);
    return binary_trace(nodes, leaves, ray, tmax, 1).prim != BVH_MISS;
}
