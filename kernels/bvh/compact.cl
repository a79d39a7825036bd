/* Traversal of the compressed 8-wide tree (Ylitie, Karras and Laine 2017), a ray a work-item: the layout for
 * GPUs, which are bound by memory.
 *
 * A node is 20 words: a corner p (3 floats); the exponents of three steps, a byte each, and in the highest
 * byte a mask of slots with nodes; the first child node; the first item; a byte for each of 8 slots; then 8
 * bytes each for low x, low y, low z, high x, high y, high z of the slots' boxes, in steps from p. Child
 * nodes are neighbours in the order of slots, and so are items.
 *
 * An empty slot's byte is 0. Bits 0 to 4 number the slot's bit in a word: 24 + slot for a node, the first of
 * at most 3 among 24 for items. Bits 5 to 7 are a mask of that many set bits. Slot i lies toward larger x, y,
 * z by bits 0, 1, 2 of i, so that a ray visits nearer slots first in the order of i xor its octant.
 *
 * `leaves` holds 12 words an item: three corners, prim, tag, an unused word. */
#include "bvh/ray.cl"

#define COMPACT_STACK (BVH_LEVELS - 1) /* below the root a level has at most a group */
#define COMPACT_NODES 0xff000000u /* of a group: the slots with nodes that wait */

typedef struct {
    float3 o, r;     /* r = 1 / d */
    float tmin;
    uint octant;     /* bits 0, 1, 2: x, y, z grow along the ray */
    uint octants;    /* the same in every byte */
} CompactRay;

/* A ray's position in a tree: groups of waiting nodes, each with a common parent. A group's x is the parent's first
 * child node; the highest byte of y is a mask of waiting nodes in the ray's order, the lowest a mask of slots with
 * nodes. */
typedef struct {
    uint2 group, *waiting; /* COMPACT_STACK of them */
    uint waits;
} CompactState;

inline CompactRay compact_ray(float ox, float oy, float oz, float dx, float dy, float dz, float tmin)
{
    uint octant = (uint)(dx >= 0.0f) | (uint)(dy >= 0.0f) << 1 | (uint)(dz >= 0.0f) << 2;
    return (CompactRay){(float3)(ox, oy, oz),
                        (float3)(ray_reciprocal(dx), ray_reciprocal(dy), ray_reciprocal(dz)), tmin, octant,
                        octant * 0x01010101u};
}

inline CompactState compact_start(uint2 *waiting) { return (CompactState){(uint2)(0u, 0x80000000u), waiting, 0}; }

inline float4 compact_min(float4 a, float4 b) { return a < b ? a : b; }
inline float4 compact_max(float4 a, float4 b) { return a > b ? a : b; }

inline float4 compact_bytes(uint word) { return convert_float4(as_uchar4(word)); }

/* The corners of the root's box. */
inline void compact_bounds(global const float *nodes, float3 *low, float3 *high)
{
    global const uint *node = (global const uint *)nodes;
    global const uchar *bytes = (global const uchar *)(node + 6);
    float lows[3], highs[3];
    for (uint axis = 0; axis < 3; axis++) {
        float step = as_float((node[3] >> 8 * axis & 0xffu) << 23);
        lows[axis] = INFINITY;
        highs[axis] = -INFINITY;
        for (uint slot = 0; slot < 8; slot++) {
            uchar first = bytes[8 + 8 * axis + slot], last = bytes[32 + 8 * axis + slot];
            if (bytes[slot] == 0 || first > last) continue;
            lows[axis] = ray_min(lows[axis], nodes[axis] + first * step);
            highs[axis] = ray_max(highs[axis], nodes[axis] + last * step);
        }
        lows[axis] -= fabs(lows[axis]) * 0x1p-22f; /* the sums were rounded */
        highs[axis] += fabs(highs[axis]) * 0x1p-22f;
    }
    *low = (float3)(lows[0], lows[1], lows[2]);
    *high = (float3)(highs[0], highs[1], highs[2]);
}

/* The bits of four slots whose boxes are hit; meta: the slots' bytes. */
inline uint compact_slots(const CompactRay *r, uint meta, int4 met)
{
    uint inner = (meta & meta << 1 & 0x10101010u) >> 4; /* 1 in the bytes of nodes */
    uint4 shift = (uint4)(0, 8, 16, 24);
    uint4 at = (uint4)(meta ^ (r->octants & inner * 7u)) >> shift & 31u;
    uint4 bits = ((uint4)(meta >> 5) >> shift & 7u) << at;
    bits &= as_uint4(met);
    return bits.x | bits.y | bits.z | bits.w;
}

/* The bits of four slots whose boxes the ray hits between tmin and t. `near` and `far`: the bytes of their planes;
 * planes are at step * byte + begin along the ray. */
inline uint compact_boxes(const CompactRay *r, float t, float3 step, float3 begin, uint3 near, uint3 far,
                          uint meta)
{
    float4 x = mad(compact_bytes(near.x), step.x, begin.x), far_x = mad(compact_bytes(far.x), step.x, begin.x);
    float4 y = mad(compact_bytes(near.y), step.y, begin.y), far_y = mad(compact_bytes(far.y), step.y, begin.y);
    float4 z = mad(compact_bytes(near.z), step.z, begin.z), far_z = mad(compact_bytes(far.z), step.z, begin.z);
    float4 entry = compact_max(compact_max(x, y), compact_max(z, (float4)(r->tmin)));
    float4 exit = compact_min(compact_min(far_x, far_y), far_z);
    exit = compact_min(compact_max(exit, exit * RAY_WIDER), (float4)(t));
    return compact_slots(r, meta, entry <= exit);
}

/* Pops the next waiting node. Returns 0 if none is left. */
inline int compact_take(const CompactRay *r, CompactState *state, uint *at)
{
    uint2 group = state->group;
    if (group.y < 1u << 24) {
        if (!state->waits) return 0;
        group = state->waiting[--state->waits];
    }
    uint bit = 31 - clz(group.y);
    group.y ^= 1u << bit;
    if (group.y >= 1u << 24) state->waiting[state->waits++] = group;
    uint slot = (bit - 24) ^ r->octant;
    *at = group.x + popcount(group.y & ((1u << slot) - 1) & 0xffu);
    return 1;
}

/* Visits the next node: bits 0 to 23 of items->y are items that the ray may hit, counted from items->x. Returns 0 if
 * no node is left. */
inline int compact_next(global const float *nodes, const CompactRay *r, float t, CompactState *state, uint2 *items)
{
    uint at;
    if (!compact_take(r, state, &at)) return 0;
    global const uint4 *node = (global const uint4 *)nodes + (ulong)at * (COMPACT_WORDS / 4);
    uint4 a = node[0], b = node[1], c = node[2], d = node[3], e = node[4];
    float3 begin = (as_float3(a.xyz) - r->o) * r->r;
    float3 step = as_float3((uint3)(a.w << 23, a.w << 15, a.w << 7) & 0x7f800000u) * r->r;
    int x = r->r.x < 0.0f, y = r->r.y < 0.0f, z = r->r.z < 0.0f;
    uint3 low = (uint3)(c.x, c.z, d.x), high = (uint3)(d.z, e.x, e.z);
    uint3 near = (uint3)(x ? high.x : low.x, y ? high.y : low.y, z ? high.z : low.z);
    uint3 far = (uint3)(x ? low.x : high.x, y ? low.y : high.y, z ? low.z : high.z);
    uint bits = compact_boxes(r, t, step, begin, near, far, b.z);
    low = (uint3)(c.y, c.w, d.y);
    high = (uint3)(d.w, e.y, e.w);
    near = (uint3)(x ? high.x : low.x, y ? high.y : low.y, z ? high.z : low.z);
    far = (uint3)(x ? low.x : high.x, y ? low.y : high.y, z ? low.z : high.z);
    bits |= compact_boxes(r, t, step, begin, near, far, b.w);
    state->group = (uint2)(b.x, (bits & COMPACT_NODES) | a.w >> 24);
    *items = (uint2)(b.y, bits & ~COMPACT_NODES);
    return 1;
}

/* Removes and returns the first of the items. */
inline uint compact_item(uint2 *items)
{
    uint bit = 31 - clz(items->y);
    items->y ^= 1u << bit;
    return items->x + bit;
}

/* Empties the stack, so that the loops end by their conditions: after a return from inside, the threads of a GPU's
 * group would not reconverge. */
inline void compact_end(CompactState *state, uint2 *items) { state->group.y = state->waits = items->y = 0; }

inline TriHit compact_hit(global const float *leaves, uint item, float t, float u, float v)
{
    global const float *c = leaves + (ulong)item * 12;
    float3 v0 = (float3)(c[0], c[1], c[2]);
    float3 e1 = (float3)(c[3], c[4], c[5]) - v0, e2 = (float3)(c[6], c[7], c[8]) - v0;
    return tri_hit(t, u, v, as_uint(c[9]), as_uint(c[10]), v0, e1, e2);
}

inline TriHit compact_closest(global const float *nodes, global const float *leaves, float ox, float oy,
                              float oz, float dx, float dy, float dz, float tmin, float tmax)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return tri_miss(tmax);
    CompactRay r = compact_ray(ox, oy, oz, dx, dy, dz, tmin);
    Shear shear = shear_make(ox, oy, oz, dx, dy, dz);
    uint2 waiting[COMPACT_STACK], items;
    CompactState state = compact_start(waiting);
    uint best = BVH_MISS;
    float t = tmax, u = 0.0f, v = 0.0f;
    while (compact_next(nodes, &r, t, &state, &items)) {
        while (items.y) {
            uint item = compact_item(&items);
            float at, b1, b2;
            int inside = shear_intersect(&shear, leaves + (ulong)item * 12, 1, &at, &b1, &b2);
            if (inside && at > tmin && at < t) {
                t = at;
                u = b1;
                v = b2;
                best = item;
            }
        }
    }
    return best == BVH_MISS ? tri_miss(tmax) : compact_hit(leaves, best, t, u, v);
}

/* Whether the ray hits anything between tmin and tmax. */
inline int compact_occluded(global const float *nodes, global const float *leaves, float ox, float oy,
                            float oz, float dx, float dy, float dz, float tmin, float tmax)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return 0;
    CompactRay r = compact_ray(ox, oy, oz, dx, dy, dz, tmin);
    Shear shear = shear_make(ox, oy, oz, dx, dy, dz);
    uint2 waiting[COMPACT_STACK], items;
    CompactState state = compact_start(waiting);
    int met = 0;
    while (compact_next(nodes, &r, tmax, &state, &items)) {
        while (items.y) {
            float at, u, v;
            uint item = compact_item(&items);
            int inside = shear_intersect(&shear, leaves + (ulong)item * 12, 1, &at, &u, &v);
            if (inside && at > tmin && at < tmax) {
                met = 1;
                compact_end(&state, &items);
            }
        }
    }
    return met;
}

/* Step all_hits: all hits of a ray; returns their number. Each triangle is a single item, so no hit comes twice. */
inline uint compact_all_hits(global const float *nodes, global const float *leaves, HitList list, float ox,
                          float oy, float oz, float dx, float dy, float dz, float tmin, float tmax)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return 0;
    CompactRay r = compact_ray(ox, oy, oz, dx, dy, dz, tmin);
    Shear shear = shear_make(ox, oy, oz, dx, dy, dz);
    uint2 waiting[COMPACT_STACK], items;
    CompactState state = compact_start(waiting);
    uint found = 0;
    while (compact_next(nodes, &r, tmax, &state, &items)) {
        while (items.y) {
            float t, u, v;
            uint item = compact_item(&items);
            int inside = shear_intersect(&shear, leaves + (ulong)item * 12, 1, &t, &u, &v);
            if (inside && t > tmin && t < tmax) hit_list_put(list, found++, compact_hit(leaves, item, t, u, v));
        }
    }
    return found;
}

/* Step keyed: traversal of a tree over moving vertices, see bvh/keyed.cl. */
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
