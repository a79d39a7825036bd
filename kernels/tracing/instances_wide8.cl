/* The 8-wide tree over instances; a leaf's word without BVH_LEAF is an instance's row. */
#include "tracing/instance_intersect.cl"

/* The row of the nearest hit instance between tmin and hit->t, or of any with `first_only`, and the hit of
 * `instance_meet`; BVH_MISS without a hit. */
inline uint instances_trace(global const float *nodes, global const float *leaves,
                            global const float *instance_nodes, Scene scene, vec3 o, vec3 d, float tmin,
                            TriHit *hit, int first_only)
{
    Wide8Ray ray = wide8_ray(o.x, o.y, o.z, d.x, d.y, d.z, tmin);
    ulong waiting[WIDE8_STACK];
    uint n = 0, at = 0, nearest = BVH_MISS;
    do {
        at = wide8_descend(instance_nodes, &ray, hit->t, at, waiting, &n);
        uint row = at & ~BVH_LEAF;
        if (!(at & BVH_LEAF) || !instance_meet(nodes, leaves, scene, row, o, d, tmin, hit, first_only)) continue;
        nearest = row;
        if (first_only) return nearest;
    } while (wide8_next(instance_nodes, &ray, waiting, &n, hit->t, &at));
    return nearest;
}
