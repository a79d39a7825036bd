/* Traversal of the binary tree of bvh/build.cl, a ray a work-item: the readable reference. `leaves` holds the triangle
 * records of bvh/leaves.cl. */
#include "bvh/triangle.cl"

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
