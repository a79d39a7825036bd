/* All hits of a ray by the binary tree; returns their number. Each triangle is in a single leaf, so no hit comes
 * twice. */
#include "bvh/binary.cl"
#include "bvh/hit_list.cl"

inline uint binary_all_hits(global const float *nodes, global const float *leaves, HitList list, float ox,
                         float oy, float oz, float dx, float dy, float dz, float tmin, float tmax)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return 0;
    Ray ray = ray_make(ox, oy, oz, dx, dy, dz, tmin);
    Shear shear = shear_make(ox, oy, oz, dx, dy, dz);
    global const float8 *tree = (global const float8 *)nodes;
    uint waiting[BVH_DEPTH + 1];
    uint n = 1, found = 0;
    waiting[0] = 0;
    while (n) {
        float8 node = tree[waiting[--n]];
        if (ray_enter(&ray, node, tmax) == INFINITY) continue;
        uint link = node_link(node);
        if (!node_is_leaf(node)) {
            waiting[n++] = link;
            waiting[n++] = link + 1;
            continue;
        }
        for (uint i = link; i < link + node_count(node); i++) {
            TriHit hit = tri_miss(tmax);
            if (triangle_intersect(leaves + (ulong)i * 16, &shear, tmin, &hit)) hit_list_put(list, found++, hit);
        }
    }
    return found;
}
