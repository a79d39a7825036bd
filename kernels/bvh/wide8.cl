/* Traversal of the 8-wide tree that collapse.cl writes, one ray a work-item: the layout for CPUs.
 *
 * A node's eight boxes, and a block's eight triangles, are tested at once in float8.
 */
#include "bvh/hit.cl"
#include "bvh/mask8.cl"
#include "bvh/ray.cl"
#include "bvh/shear.cl"

#define WIDE8_STACK (7 * BVH_DEPTH + 8) /* a node on the way leaves 7 children waiting */

typedef struct {
    float ox, oy, oz, tmin;
    float rx, ry, rz;    /* 1 / d */
    float fx, fy, fz;    /* the same for far planes, by rounding errors longer */
    uint nx, ny, nz;     /* rows of a node with the near planes; the far ones are in row ^ 1 */
    Shear shear;
} Wide8Ray;

inline float8 wide8_min(float8 a, float8 b) { return a < b ? a : b; }
inline float8 wide8_max(float8 a, float8 b) { return a > b ? a : b; }

inline Wide8Ray wide8_ray(float ox, float oy, float oz, float dx, float dy, float dz, float tmin)
{
    float rx = ray_reciprocal(dx), ry = ray_reciprocal(dy), rz = ray_reciprocal(dz);
    Wide8Ray r = {ox, oy, oz, tmin, rx, ry, rz, rx * RAY_WIDER, ry * RAY_WIDER, rz * RAY_WIDER,
                  rx < 0.0f, 2 + (ry < 0.0f), 4 + (rz < 0.0f), shear_make(ox, oy, oz, dx, dy, dz)};
    return r;
}

/* The corners of the box around everything; children that are not there are inside out. */
inline void wide8_bounds(global const float *nodes, float3 *low, float3 *high)
{
    *low = (float3)(INFINITY);
    *high = (float3)(-INFINITY);
    for (uint i = 0; i < 8; i++) {
        *low = fmin(*low, (float3)(nodes[i], nodes[16 + i], nodes[32 + i]));
        *high = fmax(*high, (float3)(nodes[8 + i], nodes[24 + i], nodes[40 + i]));
    }
}

/* The children whose box the ray meets between tmin and t, and where it enters each. */
inline Mask8 wide8_boxes(global const float *node, const Wide8Ray *r, float t, float8 *entry)
{
    global const float8 *row = (global const float8 *)node;
    float8 x = (row[r->nx] - r->ox) * r->rx, far_x = (row[r->nx ^ 1] - r->ox) * r->fx;
    float8 y = (row[r->ny] - r->oy) * r->ry, far_y = (row[r->ny ^ 1] - r->oy) * r->fy;
    float8 z = (row[r->nz] - r->oz) * r->rz, far_z = (row[r->nz ^ 1] - r->oz) * r->fz;
    *entry = wide8_max(wide8_max(x, y), wide8_max(z, (float8)(r->tmin)));
    float8 exit = wide8_min(wide8_min(far_x, far_y), wide8_min(far_z, (float8)(t)));
    return mask8(*entry <= exit);
}

inline float8 wide8_edge(float8 px, float8 py, float8 qx, float8 qy)
{
#pragma OPENCL FP_CONTRACT OFF
    return px * qy - py * qx;
}

/* The triangles of a block that the ray meets between tmin and t; at what distances, times `det`.
 * shear.cl tells why nothing slips between two of them. */
inline Mask8 wide8_triangles(global const float *block, const Wide8Ray *r, float t, float8 *distance,
                             float8 *det)
{
    global const float8 *b = (global const float8 *)block;
    const Shear *s = &r->shear;
    float8 az = b[s->kz] - s->oz, bz = b[3 + s->kz] - s->oz, cz = b[6 + s->kz] - s->oz;
    float8 ax = mad(-s->x, az, b[s->kx] - s->ox), ay = mad(-s->y, az, b[s->ky] - s->oy);
    float8 bx = mad(-s->x, bz, b[3 + s->kx] - s->ox), by = mad(-s->y, bz, b[3 + s->ky] - s->oy);
    float8 cx = mad(-s->x, cz, b[6 + s->kx] - s->ox), cy = mad(-s->y, cz, b[6 + s->ky] - s->oy);
    float8 u = wide8_edge(cx, cy, bx, by), v = wide8_edge(ax, ay, cx, cy);
    float8 w = wide8_edge(bx, by, ax, ay);
    int8 inside = (wide8_min(wide8_min(u, v), w) >= 0.0f) | (wide8_max(wide8_max(u, v), w) <= 0.0f);
    float8 sum = u + v + w, q = (u * az + v * bz + w * cz) * s->z;
    int8 sign = as_int8(sum) & (int8)(0x80000000);
    sum = as_float8(as_int8(sum) ^ sign);
    q = as_float8(as_int8(q) ^ sign);
    *distance = q;
    *det = sum;
    return mask8(inside & (q > r->tmin * sum) & (q < t * sum));
}

/* The hit record of one triangle of a block, computed again for that one alone. */
inline TriHit wide8_hit(global const float *leaves, uint slot, float t, const Wide8Ray *r)
{
    global const float *b = leaves + (ulong)(slot >> 3) * 88 + (slot & 7);
    float again, u, v;
    shear_intersect(&r->shear, b, 8, &again, &u, &v);
    float e1x = b[24] - b[0], e1y = b[32] - b[8], e1z = b[40] - b[16];
    float e2x = b[48] - b[0], e2y = b[56] - b[8], e2z = b[64] - b[16];
    TriHit hit = {t, u, v, as_uint(b[72]), as_uint(b[80]),
                  e1y * e2z - e1z * e2y, e1z * e2x - e1x * e2z, e1x * e2y - e1y * e2x};
    return hit;
}

/* From a node down to the nearest leaf, or to a node of which no child is met; what it comes to is
 * returned. The other children are left waiting in descending order: entry distance, as bits, above the
 * word, so that both are compared at once. */
inline uint wide8_descend(global const float *nodes, const Wide8Ray *r, float t, uint at, ulong *waiting,
                          uint *waits)
{
    uint n = *waits;
    while (!(at & BVH_LEAF)) {
        union { float8 v; uint at[8]; } entry;
        global const float *node = nodes + (ulong)at * 64;
        global const uint *words = (global const uint *)(node + 48);
        Mask8 m = wide8_boxes(node, r, t, &entry.v);
        if (!m) break;
        uint i = mask8_first(m);
        at = words[i];
        m &= m - 1;
        if (!m) continue; /* one child */
        ulong near = (ulong)entry.at[i] << 32 | at;
        uint base = n;
        do { /* the nearest goes on */
            i = mask8_first(m);
            m &= m - 1;
            ulong c = (ulong)entry.at[i] << 32 | words[i];
            ulong far = max(near, c);
            near = min(near, c);
            uint k = n++;
            for (; k > base && waiting[k - 1] < far; k--) waiting[k] = waiting[k - 1];
            waiting[k] = far;
        } while (m);
        at = (uint)near;
    }
    *waits = n;
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
    for (;;) {
        at = wide8_descend(nodes, &r, t, at, waiting, &n);
        if (at & BVH_LEAF) {
            uint block = at & ~BVH_LEAF;
            union { float8 v; float at[8]; } q;
            float8 det;
            Mask8 m = wide8_triangles(leaves + (ulong)block * 88, &r, t, &q.v, &det);
            if (m) q.v /= det;
            for (; m; m &= m - 1) {
                uint i = mask8_first(m);
                if (q.at[i] < t) {
                    t = q.at[i];
                    best = block * 8 + i;
                }
            }
        }
        do {
            if (!n) return best == BVH_MISS ? tri_miss(tmax) : wide8_hit(leaves, best, t, &r);
            n--;
        } while (as_float((uint)(waiting[n] >> 32)) >= t);
        at = (uint)waiting[n];
    }
}

/* Whether anything is between tmin and tmax; children with the best promise stand last. */
inline int wide8_occluded(global const float *nodes, global const float *leaves, float ox, float oy,
                          float oz, float dx, float dy, float dz, float tmin, float tmax)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return 0;
    Wide8Ray r = wide8_ray(ox, oy, oz, dx, dy, dz, tmin);
    uint waiting[WIDE8_STACK];
    uint n = 0, at = 0;
    float8 unused[2];
    for (;;) {
        if (at & BVH_LEAF) {
            global const float *block = leaves + (ulong)(at & ~BVH_LEAF) * 88;
            if (wide8_triangles(block, &r, tmax, &unused[0], &unused[1])) return 1;
        } else {
            global const float *node = nodes + (ulong)at * 64;
            global const uint *words = (global const uint *)(node + 48);
            Mask8 m = wide8_boxes(node, &r, tmax, &unused[0]);
            for (; m; m &= m - 1) waiting[n++] = words[mask8_first(m)];
        }
        if (!n) return 0;
        at = waiting[--n];
    }
}
