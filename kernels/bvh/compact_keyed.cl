/* Traversal of a compressed 8-wide tree over moving vertices, see bvh/keyed.cl and bvh/compact.cl. */
#include "bvh/compact.cl"
#include "bvh/keyed.cl"

#define KEYED(verb) compact_keyed_##verb
#define KEYED_NODE COMPACT_WORDS /* words of a node, and of an item */
#define KEYED_LEAF 12
#define COMPACT_KEYED_WIDER 0x1p-21f /* relative margin for the rounding of both keys' distances */

/* A node's planes at a key: at step * byte + begin along the ray. */
typedef struct { uint4 a, b, c, d, e; float3 begin, step; } CompactKey;

inline CompactKey compact_key(global const uint4 *node, const CompactRay *r)
{
    CompactKey k = {node[0], node[1], node[2], node[3], node[4], (float3)(0.0f), (float3)(0.0f)};
    k.begin = (as_float3(k.a.xyz) - r->o) * r->r;
    k.step = as_float3((uint3)(k.a.w << 23, k.a.w << 15, k.a.w << 7) & 0x7f800000u) * r->r;
    return k;
}

/* Distances to four planes, from bytes, steps and beginnings at both keys; moved by their rounding error times
 * `side`. */
inline float4 compact_keyed_planes(uint first, uint last, float step0, float begin0, float step1, float begin1,
                                   float share, float side)
{
    float4 t0 = mad(compact_bytes(first), step0, begin0), t1 = mad(compact_bytes(last), step1, begin1);
    return t0 * (1.0f - share) + t1 * share + side * COMPACT_KEYED_WIDER * (fabs(t0) + fabs(t1));
}

/* The bits of four slots whose boxes the ray hits between tmin and t; `half_` chooses the four. */
inline uint compact_keyed_boxes(const CompactRay *r, float t, const CompactKey *p, const CompactKey *q, float share,
                                uint half_)
{
    int x = r->r.x < 0.0f, y = r->r.y < 0.0f, z = r->r.z < 0.0f;
#define LOW(k) (half_ ? (uint3)(k->c.y, k->c.w, k->d.y) : (uint3)(k->c.x, k->c.z, k->d.x))
#define HIGH(k) (half_ ? (uint3)(k->d.w, k->e.y, k->e.w) : (uint3)(k->d.z, k->e.x, k->e.z))
    uint3 p_low = LOW(p), p_high = HIGH(p), q_low = LOW(q), q_high = HIGH(q);
#define PLANES(back, axis, side)                                                                             \
    compact_keyed_planes((back) ? p_high.axis : p_low.axis, (back) ? q_high.axis : q_low.axis, p->step.axis, \
                         p->begin.axis, q->step.axis, q->begin.axis, share, side)
    float4 entry = compact_max(compact_max(PLANES(x, x, -1.0f), PLANES(y, y, -1.0f)),
                               compact_max(PLANES(z, z, -1.0f), (float4)(r->tmin)));
    float4 exit = compact_min(compact_min(PLANES(!x, x, 1.0f), PLANES(!y, y, 1.0f)), PLANES(!z, z, 1.0f));
#undef PLANES
#undef HIGH
#undef LOW
    exit = compact_min(compact_max(exit, exit * RAY_WIDER), (float4)(t));
    return compact_slots(r, half_ ? p->b.w : p->b.z, entry <= exit);
}

/* See compact_next. */
inline int compact_keyed_next(global const float *nodes, uint count, float share, const CompactRay *r, float t,
                              CompactState *state, uint2 *items)
{
    uint at;
    if (!compact_take(r, state, &at)) return 0;
    at *= count;
    global const uint4 *node = (global const uint4 *)nodes + (ulong)at * (COMPACT_WORDS / 4);
    CompactKey p = compact_key(node, r), q = compact_key(node + COMPACT_WORDS / 4, r);
    uint bits = compact_keyed_boxes(r, t, &p, &q, share, 0) | compact_keyed_boxes(r, t, &p, &q, share, 1);
    state->group = (uint2)(p.b.x, (bits & COMPACT_NODES) | p.a.w >> 24);
    *items = (uint2)(p.b.y, bits & ~COMPACT_NODES);
    return 1;
}

/* The nearest hit, or any hit with `first_only`. */
inline TriHit compact_keyed_trace(global const float *nodes, global const float *leaves, uint count, float share,
                                  vec3 o, vec3 d, float tmin, float tmax, int first_only)
{
    TriHit hit = tri_miss(tmax);
    if (!ray_finite(o.x, o.y, o.z, d.x, d.y, d.z)) return hit;
    CompactRay r = compact_ray(o.x, o.y, o.z, d.x, d.y, d.z, tmin);
    Shear shear = shear_make(o.x, o.y, o.z, d.x, d.y, d.z);
    uint2 waiting[COMPACT_STACK], items;
    CompactState state = compact_start(waiting);
    while (compact_keyed_next(nodes, count, share, &r, hit.t, &state, &items)) {
        while (items.y) {
            global const float *record = leaves + (ulong)compact_item(&items) * count * KEYED_LEAF;
            int nearer = keyed_nearer(&shear, record, 9, KEYED_LEAF, share, tmin, &hit);
            if (nearer && first_only) compact_end(&state, &items);
        }
    }
    return hit;
}

inline TriHit compact_keyed_closest(global const float *nodes, global const float *leaves, uint count, float share,
                                    vec3 o, vec3 d, float tmin, float tmax)
{
    return compact_keyed_trace(nodes, leaves, count, share, o, d, tmin, tmax, 0);
}

inline int compact_keyed_occluded(global const float *nodes, global const float *leaves, uint count, float share,
                                  vec3 o, vec3 d, float tmin, float tmax)
{
    return compact_keyed_trace(nodes, leaves, count, share, o, d, tmin, tmax, 1).prim != BVH_MISS;
}
