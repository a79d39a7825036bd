/* The binary tree over instances; a leaf's item is an instance's row. */
#include "tracing/instance_intersect.cl"

/* The row of the nearest hit instance between tmin and hit->t, or of any with `first_only`, and the hit of
 * `instance_meet`; BVH_MISS without a hit. */
inline uint instances_trace(global const float *nodes, global const float *leaves,
                            global const float *instance_nodes, Scene scene, vec3 o, vec3 d, float tmin,
                            TriHit *hit, int first_only)
{
    Ray ray = ray_make(o.x, o.y, o.z, d.x, d.y, d.z, tmin);
    global const float8 *tree = (global const float8 *)instance_nodes;
    uint nearest = BVH_MISS;
    BinaryState s;
    binary_start(tree, &ray, hit->t, &s);
    do {
        if (binary_descend(tree, &ray, hit->t, &s)) {
            uint row = node_link(s.node);
            if (instance_meet(nodes, leaves, scene, row, o, d, tmin, hit, first_only)) {
                nearest = row;
                if (first_only) s.waits = 0;
            }
        }
    } while (binary_next(tree, hit->t, &s));
    return nearest;
}
