/* So few instances that each ray goes to all of them, by their rows. */
#include "tracing/instance_intersect.cl"

/* The row of the nearest instance that is met between tmin and hit->t, with `first_only` of any, and the
 * hit as `instance_meet` leaves it; BVH_MISS if there is none. */
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
