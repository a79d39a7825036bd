/* Instances: transforms from a group's space to the world, and rays through them. */
#include "generated/motion.cl"

/* A transform to the world by an InstanceRow; x, y and z are the rows of the inverse, the matrix from the world to the
 * group. Rows are scaled first, so that tiny and huge instances stay in float's range. */
typedef struct { vec3 x, y, z, origin; real scale; } InstanceFrame;

inline real instance_size(vec3 v) { return fabs(v.x) + fabs(v.y) + fabs(v.z); }

inline InstanceFrame instance_frame(Scene scene, mask placed, integer instance)
{
    integer row = sel_i(placed, instance - 1, (integer)(0)) * INSTANCE_ROW_WORDS;
    InstanceRow i = instance_row_row(scene.instances, row);
#if MOVES_INSTANCES
    i = motion_of_instance(scene, i);
#endif
    real size = instance_size(i.x) + instance_size(i.y) + instance_size(i.z), scale = 1.0f / size;
    return (InstanceFrame){scale3(i.x, scale), scale3(i.y, scale), scale3(i.z, scale), i.origin, scale};
}

/* A normal, by the inverse transpose, which keeps the front side but not the length. */
inline vec3 instance_normal(InstanceFrame f, vec3 n) { return madd3(f.x, n.x, madd3(f.y, n.y, scale3(f.z, n.z))); }

/* A vector, by the inverse (Cramer's rule). */
inline vec3 instance_vector(InstanceFrame f, vec3 v)
{
    vec3 yz = cross3(f.y, f.z);
    vec3 sum = madd3(yz, v.x, madd3(cross3(f.z, f.x), v.y, scale3(cross3(f.x, f.y), v.z)));
    return scale3(sum, f.scale / dot3(f.x, yz));
}

/* About the greatest length of a transformed unit vector. */
inline real instance_stretch(InstanceFrame f)
{
    vec3 yz = cross3(f.y, f.z);
    real sum = instance_size(yz) + instance_size(cross3(f.z, f.x)) + instance_size(cross3(f.x, f.y));
    return sum * fabs(f.scale / dot3(f.x, yz));
}

/* Step meet: a ray and an instance: the ray is transformed into the group's space and traverses its tree by
 * LAYOUT(verb). Its direction is not normalised, so that t is the world's. Each step below has instances_trace, which
 * returns the row of the nearest hit instance between tmin and hit->t, or of any with `first_only`, and the hit of
 * `instance_meet`; BVH_MISS without a hit. */
#include "generated/keyed_layout.cl"

/* If the ray hits the instance at row `at` between tmin and hit->t, returns 1 and replaces the hit, in the group's
 * space. With `first_only` the hit stays. */
inline int instance_meet(global const float *nodes, global const float *leaves, Scene scene, uint at, vec3 o,
                         vec3 d, float tmin, TriHit *hit, int first_only)
{
    InstanceRow i = instance_row_row(scene.instances, (int)at * INSTANCE_ROW_WORDS);
#if MOVES_INSTANCES
    i = motion_of_instance(scene, i);
#endif
    vec3 s = {o.x - i.origin.x, o.y - i.origin.y, o.z - i.origin.z};
    vec3 p = {dot3(i.x, s), dot3(i.y, s), dot3(i.z, s)}, v = {dot3(i.x, d), dot3(i.y, d), dot3(i.z, d)};
    nodes += (ulong)i.nodes * 8;
    leaves += (ulong)i.leaves * 8;
#if MOVES_VERTICES
    VertexKeys k = vertex_keys(scene, i.number, scene.time);
    if (k.count > 1) {
        nodes += k.key * KEYED_NODE;
        leaves += k.key * KEYED_LEAF;
        if (first_only) return KEYED(occluded)(nodes, leaves, (uint)k.count, k.share, p, v, tmin, hit->t);
        TriHit met = KEYED(closest)(nodes, leaves, (uint)k.count, k.share, p, v, tmin, hit->t);
        if (met.prim == BVH_MISS) return 0;
        *hit = met;
        return 1;
    }
#endif
    if (first_only) return LAYOUT(occluded)(nodes, leaves, p.x, p.y, p.z, v.x, v.y, v.z, tmin, hit->t);
    TriHit own = LAYOUT(closest)(nodes, leaves, p.x, p.y, p.z, v.x, v.y, v.z, tmin, hit->t);
    if (own.prim == BVH_MISS) return 0;
    *hit = own;
    return 1;
}

/* Step few: without a tree: each ray tests all rows. */
#include "tracing/instances.cl#meet"

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

/* Step binary: the binary tree over instances; a leaf's item is an instance's row. */
#include "tracing/instances.cl#meet"

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

/* Step wide8: the 8-wide tree over instances; a leaf's word without BVH_LEAF is an instance's row. */
#include "tracing/instances.cl#meet"

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

/* Step compact: the compressed tree over instances; an item's number is an instance's row. */
#include "tracing/instances.cl#meet"

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

/* Step hits: a single ray's hits of instances in the world, by `instances_trace`. */
#include "core/rounding.cl"

/* Replaces h by a nearer hit of an instance, in the world. */
inline void instances_closest(global const float *nodes, global const float *leaves,
                              global const float *instance_nodes, Scene scene, vec3 o, vec3 d, TriHit tri,
                              TraceHit *h)
{
    if (!ray_finite(o.x, o.y, o.z, d.x, d.y, d.z)) return;
    uint at = instances_trace(nodes, leaves, instance_nodes, scene, o, d, 0.0f, &tri, 0);
    if (at == BVH_MISS) return;
    h->t = tri.t;
    h->u = tri.u;
    h->v = tri.v;
    h->instance = as_int(at) + 1;
    h->prim = as_int(tri.prim) + instance_row_row(scene.instances, as_int(at) * INSTANCE_ROW_WORDS).prim;
    h->shape = as_int(tri.tag);
    InstanceFrame f = instance_frame(scene, 1, h->instance);
    vec3 own = v3(tri.nx, tri.ny, tri.nz), n = instance_normal(f, own);
    real size = triangle_size(tri.side, 1.0f / wide_length3(own));
    h->side = size * instance_stretch(f) + size3(sub3(madd3(d, tri.t, o), f.origin));
    real length = h->side * h->side / wide_length3(n); /* like a triangle that is not thin */
    h->n = scale3(n, length);
    h->plane = tri.plane * f.scale * length + dot3(h->n, f.origin);
}

inline int instances_occluded(global const float *nodes, global const float *leaves,
                              global const float *instance_nodes, Scene scene, vec3 o, vec3 d, float t)
{
    if (!ray_finite(o.x, o.y, o.z, d.x, d.y, d.z)) return 0;
    TriHit tri = tri_miss(t);
    return instances_trace(nodes, leaves, instance_nodes, scene, o, d, 0.0f, &tri, 1) != BVH_MISS;
}
