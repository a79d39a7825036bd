/* Traversal of a binary tree over moving vertices, see bvh/keyed.cl and bvh/binary.cl. */
#include "bvh/binary.cl"
#include "bvh/keyed.cl"

#define KEYED(verb) binary_keyed_##verb
#define KEYED_NODE 8 /* floats of a node, and of a record */
#define KEYED_LEAF 16

inline float8 binary_keyed_node(global const float8 *tree, uint at, uint count, float share)
{
    float8 node = tree[at * count], found = keyed_row(node, tree[at * count + 1], share);
    found.s3 = node.s3;
    found.s7 = node.s7;
    return found;
}

/* The nearest hit, or any hit with `first_only`. */
inline TriHit binary_keyed_trace(global const float *nodes, global const float *leaves, uint count, float share,
                                 vec3 o, vec3 d, float tmin, float tmax, int first_only)
{
    TriHit hit = tri_miss(tmax);
    if (!ray_finite(o.x, o.y, o.z, d.x, d.y, d.z)) return hit;
    Ray ray = ray_make(o.x, o.y, o.z, d.x, d.y, d.z, tmin);
    Shear shear = shear_make(o.x, o.y, o.z, d.x, d.y, d.z);
    global const float8 *tree = (global const float8 *)nodes;
    uint waiting[BVH_DEPTH + 1], waits = 1;
    waiting[0] = 0;
    while (waits) {
        float8 node = binary_keyed_node(tree, waiting[--waits], count, share);
        if (!(ray_enter(&ray, node, hit.t) < INFINITY)) continue;
        uint link = node_link(node);
        if (!node_is_leaf(node)) { /* the nearer child first */
            float8 left = binary_keyed_node(tree, link, count, share);
            float8 right = binary_keyed_node(tree, link + 1, count, share);
            uint last = ray_enter(&ray, right, hit.t) >= ray_enter(&ray, left, hit.t);
            waiting[waits++] = link + last;
            waiting[waits++] = link + 1 - last;
            continue;
        }
        for (uint i = link; i < link + node_count(node); i++) {
            global const float *record = leaves + (ulong)i * count * KEYED_LEAF;
            if (keyed_nearer(&shear, record, 12, KEYED_LEAF, share, tmin, &hit) && first_only) waits = 0;
        }
    }
    return hit;
}

inline TriHit binary_keyed_closest(global const float *nodes, global const float *leaves, uint count, float share,
                                   vec3 o, vec3 d, float tmin, float tmax)
{
    return binary_keyed_trace(nodes, leaves, count, share, o, d, tmin, tmax, 0);
}

inline int binary_keyed_occluded(global const float *nodes, global const float *leaves, uint count, float share,
                                 vec3 o, vec3 d, float tmin, float tmax)
{
    return binary_keyed_trace(nodes, leaves, count, share, o, d, tmin, tmax, 1).prim != BVH_MISS;
}
