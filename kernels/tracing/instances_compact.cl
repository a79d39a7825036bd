/* The compressed tree over instances; an item's number is an instance's row. */
#include "tracing/instance_intersect.cl"

/* The row of the nearest hit instance between tmin and hit->t, or of any with `first_only`, and the hit of
 * `instance_meet`; BVH_MISS without a hit. */
inline uint instances_trace(global const float *nodes, global const float *leaves,
                            global const float *instance_nodes, Scene scene, vec3 o, vec3 d, float tmin,
                            TriHit *hit, int first_only)
{
    CompactRay ray = compact_ray(o.x, o.y, o.z, d.x, d.y, d.z, tmin);
    uint2 waiting[COMPACT_STACK], items;
    CompactState state = compact_start(waiting);
    uint nearest = BVH_MISS;
    while (compact_next(instance_nodes, &ray, hit->t, &state, &items)) {
        while (items.y) {
            uint row = compact_item(&items);
            if (instance_meet(nodes, leaves, scene, row, o, d, tmin, hit, first_only)) {
                nearest = row;
                if (first_only) compact_end(&state, &items);
            }
        }
    }
    return nearest;
}
