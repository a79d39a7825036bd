/* The 8-wide tree over instances; a leaf's word is, but for BVH_LEAF, the row of an instance. */
#include "tracing/instance_intersect.cl"

/* The row of the nearest instance that is met between tmin and hit->t, with `first_only` of any, and the
 * hit as `instance_meet` leaves it; BVH_MISS if there is none. */
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
