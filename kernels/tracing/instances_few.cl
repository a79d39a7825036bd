/* Few instances without a tree: each ray tests all rows. */
#include "tracing/instance_intersect.cl"

/* The row of the nearest hit instance between tmin and hit->t, or of any with `first_only`, and the hit of
 * `instance_meet`; BVH_MISS without a hit. */
inline uint instances_trace(global const float *nodes, global const float *leaves,
                            global const float *instance_nodes, Scene scene, vec3 o, vec3 d, float tmin,
                            TriHit *hit, int first_only)
{
    uint nearest = BVH_MISS;
    for (uint row = 0; row < FEW_INSTANCES; row++) {
        if (!instance_meet(nodes, leaves, scene, row, o, d, tmin, hit, first_only)) continue;
        nearest = row;
        if (first_only) return nearest;
    }
    return nearest;
}
