/* Traversal of the 8-wide tree of bvh/collapse.cl, a ray a work-item: the layout for CPUs.
 *
 * A node's eight boxes, and a block's eight triangles, are tested at once in float8. bvh/wide8_stack.cl has
 * the stack.
 */
#include "bvh/mask8.cl"
#include "bvh/ray.cl"

/* A margin of offsets for rounding. The products o * r and plane * r have relative errors up to 2^-24; their difference
 * is the distance, whose errors RAY_WIDER covers. */
#define WIDE8_PRODUCTS 0x1p-22f

typedef struct {
    float tmin;
    float rx, ry, rz, px, py, pz; /* entry distance of a box: plane * r + p */
    float fx, fy, fz, gx, gy, gz; /* exit distance: plane * f + g */
    uint nx, ny, nz; /* rows of a node with near planes; far planes are in row ^ 1 */
    Shear shear;
} Wide8Ray;

inline float8 wide8_min(float8 a, float8 b) { return a < b ? a : b; }
inline float8 wide8_max(float8 a, float8 b) { return a > b ? a : b; }

inline Wide8Ray wide8_ray(float ox, float oy, float oz, float dx, float dy, float dz, float tmin)
{
    float4 o = (float4)(ox, oy, oz, 0.0f);
    float4 r = (float4)(ray_reciprocal(dx), ray_reciprocal(dy), ray_reciprocal(dz), 1.0f), f = r * RAY_WIDER;
    float4 p = -o * r, g = -o * f, wider = copysign((float4)(WIDE8_PRODUCTS), p);
    p *= 1.0f - wider;
    g *= 1.0f + wider;
    return (Wide8Ray){tmin, r.x, r.y, r.z, p.x, p.y, p.z, f.x, f.y, f.z, g.x, g.y, g.z,
                      r.x < 0.0f, 2 + (r.y < 0.0f), 4 + (r.z < 0.0f), shear_make(ox, oy, oz, dx, dy, dz)};
}

/* The corners of the root's box; boxes of missing children are inverted. */
inline void wide8_bounds(global const float *nodes, float3 *low, float3 *high)
{
    *low = (float3)(INFINITY);
    *high = (float3)(-INFINITY);
    for (uint i = 0; i < 8; i++) {
        *low = fmin(*low, (float3)(nodes[i], nodes[16 + i], nodes[32 + i]));
        *high = fmax(*high, (float3)(nodes[8 + i], nodes[24 + i], nodes[40 + i]));
    }
}

/* The children whose boxes the ray hits between tmin and t, and its entry distances. */
inline Mask8 wide8_boxes(global const float *node, const Wide8Ray *r, float t, float8 *entry)
{
    global const float8 *row = (global const float8 *)node;
    float8 x = row[r->nx] * r->rx + r->px, far_x = row[r->nx ^ 1] * r->fx + r->gx;
    float8 y = row[r->ny] * r->ry + r->py, far_y = row[r->ny ^ 1] * r->fy + r->gy;
    float8 z = row[r->nz] * r->rz + r->pz, far_z = row[r->nz ^ 1] * r->fz + r->gz;
    *entry = wide8_max(wide8_max(x, y), wide8_max(z, (float8)(r->tmin)));
    float8 exit = wide8_min(wide8_min(far_x, far_y), wide8_min(far_z, (float8)(t)));
    return mask8(*entry <= exit);
}

inline float8 wide8_edge(float8 px, float8 py, float8 qx, float8 qy)
{
#pragma OPENCL FP_CONTRACT OFF
    return px * qy - py * qx;
}

/* The body of a function that tests the triangles of a block, whose rows are b[0] to b[8]. */
#define WIDE8_TRIANGLES                                                                              \
    const Shear *s = &r->shear;                                                                      \
    float8 az = b[s->kz] - s->oz, bz = b[3 + s->kz] - s->oz, cz = b[6 + s->kz] - s->oz;              \
    float8 ax = b[s->kx] - s->ox - s->x * az, ay = b[s->ky] - s->oy - s->y * az;                     \
    float8 bx = b[3 + s->kx] - s->ox - s->x * bz, by = b[3 + s->ky] - s->oy - s->y * bz;             \
    float8 cx = b[6 + s->kx] - s->ox - s->x * cz, cy = b[6 + s->ky] - s->oy - s->y * cz;             \
    float8 u = wide8_edge(cx, cy, bx, by), v = wide8_edge(ax, ay, cx, cy);                           \
    float8 w = wide8_edge(bx, by, ax, ay);                                                           \
    int8 inside = (wide8_min(wide8_min(u, v), w) >= 0.0f) | (wide8_max(wide8_max(u, v), w) <= 0.0f); \
    float8 sum = u + v + w, q = (u * az + v * bz + w * cz) * s->z;                                   \
    int8 sign = as_int8(sum) & (int8)(0x80000000);                                                   \
    sum = as_float8(as_int8(sum) ^ sign);                                                            \
    q = as_float8(as_int8(q) ^ sign);                                                                \
    *distance = q;                                                                                   \
    *det = sum;                                                                                      \
    return mask8(inside & (q > r->tmin * sum) & (q < t * sum));

/* The triangles of a block that the ray hits between tmin and t, and their distances times `det`. bvh/ray.cl tells
 * why no ray slips between two triangles. */
inline Mask8 wide8_triangles(global const float *block, const Wide8Ray *r, float t, float8 *distance,
                             float8 *det) { global const float8 *b = (global const float8 *)block; WIDE8_TRIANGLES }

/* The hit record of a triangle of a block, computed again in scalars. */
inline TriHit wide8_hit(global const float *leaves, uint slot, float t, const Wide8Ray *r)
{
    global const float *b = leaves + (ulong)(slot >> 3) * 88 + (slot & 7);
    float again, u, v;
    shear_intersect(&r->shear, b, 8, &again, &u, &v);
    float3 v0 = (float3)(b[0], b[8], b[16]);
    float3 e1 = (float3)(b[24], b[32], b[40]) - v0, e2 = (float3)(b[48], b[56], b[64]) - v0;
    return tri_hit(t, u, v, as_uint(b[72]), as_uint(b[80]), v0, e1, e2);
}

#include "bvh/wide8_stack.cl"

/* Descends from a node to the nearest leaf, or to a node without hit children; returns its word. */
inline uint wide8_descend(global const float *nodes, const Wide8Ray *r, float t, uint at, ulong *waiting,
                          uint *waits)
{
    while (!(at & BVH_LEAF)) {
        union { float8 v; uint at[8]; } entry;
        Mask8 m = wide8_boxes(nodes + (ulong)at * 64, r, t, &entry.v);
        if (!m) break;
        at = wide8_nearest(nodes, at, entry.at, m, waiting, waits);
    }
    return at;
}

inline TriHit wide8_closest(global const float *nodes, global const float *leaves, float ox, float oy,
                            float oz, float dx, float dy, float dz, float tmin, float tmax)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return tri_miss(tmax);
    Wide8Ray r = wide8_ray(ox, oy, oz, dx, dy, dz, tmin);
    ulong waiting[WIDE8_STACK];
    uint n = 0, at = 0, best = BVH_MISS;
    float t = tmax;
    do {
        at = wide8_descend(nodes, &r, t, at, waiting, &n);
        if (at & BVH_LEAF) wide8_nearer(leaves, at & ~BVH_LEAF, &r, &t, &best);
    } while (wide8_next(nodes, &r, waiting, &n, t, &at));
    return best == BVH_MISS ? tri_miss(tmax) : wide8_hit(leaves, best, t, &r);
}

/* Whether the ray hits anything between tmin and tmax. */
inline int wide8_occluded(global const float *nodes, global const float *leaves, float ox, float oy,
                          float oz, float dx, float dy, float dz, float tmin, float tmax)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return 0;
    Wide8Ray r = wide8_ray(ox, oy, oz, dx, dy, dz, tmin);
    WIDE8_SETS
    uint at = 0;
    Mask8 m;
    float8 unused;
    do {
        m = 0;
        if (at & BVH_LEAF) {
            if (wide8_meets(leaves, at & ~BVH_LEAF, &r, tmax)) return 1;
        } else {
            m = wide8_boxes(nodes + (ulong)at * 64, &r, tmax, &unused);
        }
    } while (WIDE8_LAST(nodes, at, m, &at));
    return 0;
}

/* Step interleaved: rays that step to their next node or block in turn, whose memory is prefetched while the other rays
 * step. This pays for incoherent rays in a tree larger than the caches. */
#include "bvh/hints.cl"

typedef struct {
    Wide8Ray ray;
    float t; /* tmax, or the nearest distance so far */
    uint at, waits, best;
    union {
        ulong nearest[WIDE8_STACK];
        struct { uint nodes[BVH_DEPTH]; Mask8 sets[BVH_DEPTH]; } last;
    } waiting;
} Wide8RayState;

/* Whether two rays' directions are within 13 degrees, by the squared cosine. */
inline int wide8_alike(float3 a, float3 b)
{
    float along = dot(a, b);
    return along > 0.0f && along * along > 0.95f * dot(a, a) * dot(b, b);
}

/* Prefetches the cache lines of a node or a block. */
inline void wide8_fetch(global const float *nodes, global const float *leaves, uint at)
{
    global const float *from = at & BVH_LEAF ? leaves + (ulong)(at & ~BVH_LEAF) * 88 : nodes + (ulong)at * 64;
    for (uint line = 0; line < 5; line++) FETCH(from + 16 * line);
}

/* Starts a ray; returns 0 if it is not finite and hits nothing. */
inline int wide8_start(Wide8RayState *s, float ox, float oy, float oz, float dx, float dy, float dz, float tmin,
                       float tmax)
{
    s->t = tmax;
    s->at = s->waits = 0;
    s->best = BVH_MISS;
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return 0;
    s->ray = wide8_ray(ox, oy, oz, dx, dy, dz, tmin);
    return 1;
}

/* The next node or block of a ray for its nearest hit; returns 0 at the end, where wide8_finish returns the hit. */
inline int wide8_step(global const float *nodes, global const float *leaves, Wide8RayState *s)
{
    uint at = s->at;
    Mask8 m = 0;
    if (at & BVH_LEAF) {
        wide8_nearer(leaves, at & ~BVH_LEAF, &s->ray, &s->t, &s->best);
    } else {
        union { float8 v; uint at[8]; } entry;
        m = wide8_boxes(nodes + (ulong)at * 64, &s->ray, s->t, &entry.v);
        if (m) at = wide8_nearest(nodes, at, entry.at, m, s->waiting.nearest, &s->waits);
    }
    if (!m && !wide8_later(nodes, s->waiting.nearest, &s->waits, s->t, &at)) return 0;
    s->at = at;
    wide8_fetch(nodes, leaves, at);
    return 1;
}

inline TriHit wide8_finish(global const float *leaves, const Wide8RayState *s)
{
    return s->best == BVH_MISS ? tri_miss(s->t) : wide8_hit(leaves, s->best, s->t, &s->ray);
}

/* The next node or block of a ray for any hit; returns 0 at the end, where `best` is BVH_MISS without a hit. */
inline int wide8_step_any(global const float *nodes, global const float *leaves, Wide8RayState *s)
{
    uint at = s->at;
    Mask8 m = 0;
    float8 unused[2];
    if (at & BVH_LEAF) {
        uint block = at & ~BVH_LEAF;
        if (wide8_triangles(leaves + (ulong)block * 88, &s->ray, s->t, &unused[0], &unused[1])) {
            s->best = block;
            return 0;
        }
    } else {
        m = wide8_boxes(nodes + (ulong)at * 64, &s->ray, s->t, &unused[0]);
    }
    if (!wide8_last(nodes, at, m, s->waiting.last.nodes, s->waiting.last.sets, &s->waits, &s->at)) return 0;
    wide8_fetch(nodes, leaves, s->at);
    return 1;
}

/* Step all_hits: all hits of a ray; returns their number. Each triangle is in a single block, so no hit comes twice. */
inline uint wide8_all_hits(global const float *nodes, global const float *leaves, HitList list, float ox,
                        float oy, float oz, float dx, float dy, float dz, float tmin, float tmax)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return 0;
    Wide8Ray r = wide8_ray(ox, oy, oz, dx, dy, dz, tmin);
    uint waiting[7 * BVH_LEVELS + 8];
    uint n = 1, found = 0;
    waiting[0] = 0;
    while (n) {
        uint at = waiting[--n];
        union { float8 v; float at[8]; } q;
        float8 det;
        if (at & BVH_LEAF) {
            uint block = at & ~BVH_LEAF;
            Mask8 m = wide8_triangles(leaves + (ulong)block * 88, &r, tmax, &q.v, &det);
            q.v /= det;
            for (; m; m &= m - 1) {
                uint i = mask8_first(m);
                hit_list_put(list, found++, wide8_hit(leaves, block * 8 + i, q.at[i], &r));
            }
        } else {
            global const float *node = nodes + (ulong)at * 64;
            global const uint *words = (global const uint *)(node + 48);
            Mask8 m = wide8_boxes(node, &r, tmax, &q.v);
            for (; m; m &= m - 1) waiting[n++] = words[mask8_first(m)];
        }
    }
    return found;
}

/* Step keyed: traversal of a tree over moving vertices, see bvh/keyed.cl. The words of nodes count nodes and blocks of
 * all keys. */
#include "bvh/keyed.cl"

#define KEYED(verb) wide8_keyed_##verb
#define KEYED_NODE 64 /* floats of a node, and of a block */
#define KEYED_LEAF 88

inline float8 wide8_keyed_row(global const float8 *rows, uint i, float share)
{
    return keyed_row(rows[i], rows[i + KEYED_NODE / 8], share);
}

inline Mask8 wide8_keyed_boxes(global const float *node, float share, const Wide8Ray *r, float t, float8 *entry)
{
    global const float8 *row = (global const float8 *)node;
    float8 x = wide8_keyed_row(row, r->nx, share) * r->rx + r->px;
    float8 y = wide8_keyed_row(row, r->ny, share) * r->ry + r->py;
    float8 z = wide8_keyed_row(row, r->nz, share) * r->rz + r->pz;
    float8 far_x = wide8_keyed_row(row, r->nx ^ 1, share) * r->fx + r->gx;
    float8 far_y = wide8_keyed_row(row, r->ny ^ 1, share) * r->fy + r->gy;
    float8 far_z = wide8_keyed_row(row, r->nz ^ 1, share) * r->fz + r->gz;
    *entry = wide8_max(wide8_max(x, y), wide8_max(z, (float8)(r->tmin)));
    float8 exit = wide8_min(wide8_min(far_x, far_y), wide8_min(far_z, (float8)(t)));
    return mask8(*entry <= exit);
}

/* The triangles of a block that the ray hits between tmin and t; see wide8_triangles. */
inline Mask8 wide8_keyed_block(global const float *block, float share, const Wide8Ray *r, float t, float8 *distance,
                               float8 *det)
{
    global const float8 *rows = (global const float8 *)block;
    float8 b[9];
    for (uint i = 0; i < 9; i++) b[i] = keyed_row(rows[i], rows[i + KEYED_LEAF / 8], share);
    WIDE8_TRIANGLES
}

inline TriHit wide8_keyed_hit(global const float *leaves, float share, uint slot, float t, const Wide8Ray *r)
{
    global const float *b = leaves + (ulong)(slot >> 3) * KEYED_LEAF + (slot & 7);
    float corners[9], again, u, v;
    keyed_corners(b, 8, KEYED_LEAF, share, corners);
    keyed_intersect(&r->shear, corners, 1, &again, &u, &v);
    return keyed_hit(corners, t, u, v, as_uint(b[72]), as_uint(b[80]));
}

/* count: of keys, a factor in the words of wide nodes. */
inline TriHit wide8_keyed_closest(global const float *nodes, global const float *leaves, uint count, float share,
                                  vec3 o, vec3 d, float tmin, float tmax)
{
    if (!ray_finite(o.x, o.y, o.z, d.x, d.y, d.z)) return tri_miss(tmax);
    Wide8Ray r = wide8_ray(o.x, o.y, o.z, d.x, d.y, d.z, tmin);
    ulong waiting[WIDE8_STACK];
    uint n = 0, at = 0, best = BVH_MISS;
    float t = tmax;
    do {
        while (!(at & BVH_LEAF)) {
            union { float8 v; uint at[8]; } entry;
            Mask8 m = wide8_keyed_boxes(nodes + (ulong)at * KEYED_NODE, share, &r, t, &entry.v);
            if (!m) break;
            at = wide8_nearest(nodes, at, entry.at, m, waiting, &n);
        }
        if (!(at & BVH_LEAF)) continue;
        union { float8 v; float at[8]; } q;
        float8 det;
        uint block = at & ~BVH_LEAF;
        Mask8 m = wide8_keyed_block(leaves + (ulong)block * KEYED_LEAF, share, &r, t, &q.v, &det);
        if (m) q.v /= det;
        for (; m; m &= m - 1) {
            uint i = mask8_first(m);
            if (q.at[i] >= t) continue;
            t = q.at[i];
            best = block * 8 + i;
        }
    } while (wide8_later(nodes, waiting, &n, t, &at));
    return best == BVH_MISS ? tri_miss(tmax) : wide8_keyed_hit(leaves, share, best, t, &r);
}

inline int wide8_keyed_occluded(global const float *nodes, global const float *leaves, uint count, float share,
                                vec3 o, vec3 d, float tmin, float tmax)
{
    if (!ray_finite(o.x, o.y, o.z, d.x, d.y, d.z)) return 0;
    Wide8Ray r = wide8_ray(o.x, o.y, o.z, d.x, d.y, d.z, tmin);
    WIDE8_SETS
    uint at = 0;
    Mask8 m;
    float8 unused[2];
    do {
        m = 0;
        if (at & BVH_LEAF) {
            global const float *block = leaves + (ulong)(at & ~BVH_LEAF) * KEYED_LEAF;
            if (wide8_keyed_block(block, share, &r, tmax, &unused[0], &unused[1])) return 1;
        } else {
            m = wide8_keyed_boxes(nodes + (ulong)at * KEYED_NODE, share, &r, tmax, &unused[0]);
        }
    } while (WIDE8_LAST(nodes, at, m, &at));
    return 0;
}
