/* All hits of a ray by the 8-wide tree; returns their number. Each triangle is in a single block, so no hit comes
 * twice. */
#include "bvh/wide8.cl"
#include "bvh/hit_list.cl"

inline uint wide8_all_hits(global const float *nodes, global const float *leaves, HitList list, float ox,
                        float oy, float oz, float dx, float dy, float dz, float tmin, float tmax)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return 0;
    Wide8Ray r = wide8_ray(ox, oy, oz, dx, dy, dz, tmin);
    uint waiting[7 * BVH_LEVELS + 8];
    uint n = 1, found = 0;
    waiting[0] = 0;
    while (n) {
        uint at = waiting[--n];
        union { float8 v; float at[8]; } q;
        float8 det;
        if (at & BVH_LEAF) {
            uint block = at & ~BVH_LEAF;
            Mask8 m = wide8_triangles(leaves + (ulong)block * 88, &r, tmax, &q.v, &det);
            q.v /= det;
            for (; m; m &= m - 1) {
                uint i = mask8_first(m);
                hit_list_put(list, found++, wide8_hit(leaves, block * 8 + i, q.at[i], &r));
            }
        } else {
            global const float *node = nodes + (ulong)at * 64;
            global const uint *words = (global const uint *)(node + 48);
            Mask8 m = wide8_boxes(node, &r, tmax, &q.v);
            for (; m; m &= m - 1) waiting[n++] = words[mask8_first(m)];
        }
    }
    return found;
}
