/* The binary tree over instances; a leaf is one of them, and its item is the instance's row. */
#include "tracing/instance_intersect.cl"

/* The row of the nearest instance that is met between tmin and hit->t, with `first_only` of any, and the
 * hit as `instance_meet` leaves it; BVH_MISS if there is none. */
inline uint instances_trace(global const float *nodes, global const float *leaves,
                            global const float *instance_nodes, Scene scene, vec3 o, vec3 d, float tmin,
                            TriHit *hit, int first_only)
{
    Ray ray = ray_make(o.x, o.y, o.z, d.x, d.y, d.z, tmin);
    global const float8 *tree = (global const float8 *)instance_nodes;
    uint waiting[BVH_DEPTH];
    float entries[BVH_DEPTH];
    uint n = 0, noise_sums = BVH_MISS;
    float8 node = tree[0];
    float entry = ray_enter(&ray, node, hit->t);
    for (;;) {
        if (entry < INFINITY && !node_is_leaf(node)) {
            uint left = node_link(node);
            float8 other = tree[left + 1];
            node = tree[left];
            entry = ray_enter(&ray, node, hit->t);
            float other_entry = ray_enter(&ray, other, hit->t);
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
        if (entry < INFINITY &&
            instance_meet(nodes, leaves, scene, node_link(node), o, d, tmin, hit, first_only)) {
            noise_sums = node_link(node);
            if (first_only) return noise_sums;
        }
        do {
            if (!n) return noise_sums;
            entry = entries[--n];
        } while (entry >= hit->t);
        node = tree[waiting[n]];
    }
}
