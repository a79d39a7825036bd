/* Traversal of the binary tree of bvh/build.cl, a ray a work-item: the readable reference. `leaves` holds the triangle
 * records of bvh/leaves.cl. */
#include "bvh/ray.cl"

/* The corners of the root's box. */
inline void binary_bounds(global const float *nodes, float3 *low, float3 *high)
{
    float8 root = *(global const float8 *)nodes;
    *low = root.s012;
    *high = root.s456;
}

/* A ray's position in a tree: a node, its entry distance `entry` (INFINITY: no entry), and a stack of farther nodes. */
typedef struct {
    float8 node;
    float entry;
    uint waits, waiting[BVH_DEPTH];
    float entries[BVH_DEPTH];
} BinaryState;

inline void binary_start(global const float8 *tree, const Ray *ray, float t, BinaryState *s)
{
    s->waits = 0;
    s->node = tree[0];
    s->entry = ray_enter(ray, s->node, t);
}

/* Descends from a node to the nearest leaf; returns 0 if the ray enters no child. */
inline int binary_descend(global const float8 *tree, const Ray *ray, float t, BinaryState *s)
{
    while (s->entry < INFINITY && !node_is_leaf(s->node)) {
        uint left = node_link(s->node);
        float8 other = tree[left + 1];
        s->node = tree[left];
        s->entry = ray_enter(ray, s->node, t);
        float other_entry = ray_enter(ray, other, t);
        if (fmax(s->entry, other_entry) < INFINITY) { /* both: the farther child waits */
            s->waiting[s->waits] = left + (other_entry >= s->entry);
            s->entries[s->waits++] = fmax(s->entry, other_entry);
        }
        if (other_entry < s->entry) {
            s->node = other;
            s->entry = other_entry;
        }
    }
    return s->entry < INFINITY;
}

/* Pops the last node that is nearer than t; returns 0 without such a node. */
inline int binary_next(global const float8 *tree, float t, BinaryState *s)
{
    do {
        if (!s->waits) return 0;
        s->entry = s->entries[--s->waits];
    } while (s->entry >= t);
    s->node = tree[s->waiting[s->waits]];
    return 1;
}

/* The nearest hit, or any hit with `first_only`. */
inline TriHit binary_trace(global const float *nodes, global const float *leaves, Ray ray, float tmax,
                           int first_only)
{
    Shear shear = shear_make(ray.o.x, ray.o.y, ray.o.z, ray.d.x, ray.d.y, ray.d.z);
    global const float8 *tree = (global const float8 *)nodes;
    TriHit hit = tri_miss(tmax);
    BinaryState s;
    binary_start(tree, &ray, hit.t, &s);
    do {
        if (binary_descend(tree, &ray, hit.t, &s)) {
            uint begin = node_link(s.node), end = begin + node_count(s.node);
            for (uint i = begin; i < end; i++) triangle_intersect(leaves + (ulong)i * 16, &shear, ray.tmin, &hit);
            if (first_only && hit.prim != BVH_MISS) s.waits = 0; /* no return: see compact_end */
        }
    } while (binary_next(tree, hit.t, &s));
    return hit;
}

inline TriHit binary_closest(global const float *nodes, global const float *leaves, float ox, float oy,
                             float oz, float dx, float dy, float dz, float tmin, float tmax)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return tri_miss(tmax);
    return binary_trace(nodes, leaves, ray_make(ox, oy, oz, dx, dy, dz, tmin), tmax, 0);
}

inline int binary_occluded(global const float *nodes, global const float *leaves, float ox, float oy,
                           float oz, float dx, float dy, float dz, float tmin, float tmax)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return 0;
    Ray ray = ray_make(ox, oy, oz, dx, dy, dz, tmin);
    return binary_trace(nodes, leaves, ray, tmax, 1).prim != BVH_MISS;
}

/* Step all_hits: all hits of a ray; returns their number. Each triangle is in a single leaf, so no hit comes twice. */
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

/* Step keyed: traversal of a tree over moving vertices, see bvh/keyed.cl. */
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
