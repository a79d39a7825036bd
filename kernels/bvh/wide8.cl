/* Traversal of the 8-wide tree of bvh/collapse.cl, a ray a work-item: the layout for CPUs.
 *
 * A node's eight boxes, and a block's eight triangles, are tested at once in float8. The stack is in
 * bvh/wide8_waiting.cl, or on devices without vectors, such as GPUs, in bvh/wide8_levels.cl.
 */
#include "bvh/hit.cl"
#include "bvh/mask8.cl"
#include "bvh/ray.cl"
#include "bvh/shear.cl"

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
    Wide8Ray ray = {tmin, r.x, r.y, r.z, p.x, p.y, p.z, f.x, f.y, f.z, g.x, g.y, g.z,
                    r.x < 0.0f, 2 + (r.y < 0.0f), 4 + (r.z < 0.0f), shear_make(ox, oy, oz, dx, dy, dz)};
    return ray;
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

/* The triangles of a block that the ray hits between tmin and t, and their distances times `det`. bvh/shear.cl tells
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

#include "bvh/wide8_waiting.cl"

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
