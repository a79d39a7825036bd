/* Traversal of the 8-wide tree that collapse.cl writes, one ray a work-item: the layout for CPUs.
 *
 * A node's eight boxes, and a block's eight triangles, are tested at once in float8.
 */
#include "bvh/hit.cl"
#include "bvh/mask8.cl"
#include "bvh/ray.cl"

#define WIDE8_STACK (7 * BVH_DEPTH + 8) /* a node on the way leaves 7 children waiting */

typedef struct {
    float ox, oy, oz, dx, dy, dz, tmin;
    float rx, ry, rz;    /* 1 / d */
    float qx, qy, qz;    /* o / d */
    uint nx, ny, nz;     /* rows of a node with the near planes; the far ones are in row ^ 1 */
} Wide8Ray;

inline float8 wide8_min(float8 a, float8 b) { return a < b ? a : b; }
inline float8 wide8_max(float8 a, float8 b) { return a > b ? a : b; }

inline Wide8Ray wide8_ray(float ox, float oy, float oz, float dx, float dy, float dz, float tmin)
{
    float rx = ray_reciprocal(dx), ry = ray_reciprocal(dy), rz = ray_reciprocal(dz);
    Wide8Ray r = {ox, oy, oz, dx, dy, dz, tmin, rx, ry, rz, ox * rx, oy * ry, oz * rz,
                  rx < 0.0f, 2 + (ry < 0.0f), 4 + (rz < 0.0f)};
    return r;
}

/* The children whose box the ray meets between tmin and t, and where it enters each. */
inline Mask8 wide8_boxes(global const float8 *node, const Wide8Ray *r, float t, float8 *entry)
{
    float8 x = mad(node[r->nx], r->rx, -r->qx), far_x = mad(node[r->nx ^ 1], r->rx, -r->qx);
    float8 y = mad(node[r->ny], r->ry, -r->qy), far_y = mad(node[r->ny ^ 1], r->ry, -r->qy);
    float8 z = mad(node[r->nz], r->rz, -r->qz), far_z = mad(node[r->nz ^ 1], r->rz, -r->qz);
    *entry = wide8_max(wide8_max(x, y), wide8_max(z, (float8)(r->tmin)));
    float8 exit = wide8_min(wide8_min(far_x, far_y), wide8_min(far_z, (float8)(t)));
    return mask8(*entry <= exit);
}

/* The triangles of a block that the ray meets between tmin and t, and the distances (Moeller and
 * Trumbore 1997, without its division; edges belong to both sides). */
inline Mask8 wide8_triangles(global const float8 *b, const Wide8Ray *r, float t, float8 *distance)
{
    float8 e1x = b[3], e1y = b[4], e1z = b[5], e2x = b[6], e2y = b[7], e2z = b[8];
    float8 hx = r->dy * e2z - r->dz * e2y;
    float8 hy = r->dz * e2x - r->dx * e2z;
    float8 hz = r->dx * e2y - r->dy * e2x;
    float8 sx = r->ox - b[0], sy = r->oy - b[1], sz = r->oz - b[2];
    float8 gx = sy * e1z - sz * e1y;
    float8 gy = sz * e1x - sx * e1z;
    float8 gz = sx * e1y - sy * e1x;
    float8 det = e1x * hx + e1y * hy + e1z * hz;
    int8 sign = as_int8(det) & (int8)(0x80000000);
    float8 size = as_float8(as_int8(det) ^ sign);
    float8 u = as_float8(as_int8(sx * hx + sy * hy + sz * hz) ^ sign);
    float8 v = as_float8(as_int8(r->dx * gx + r->dy * gy + r->dz * gz) ^ sign);
    float8 q = as_float8(as_int8(e2x * gx + e2y * gy + e2z * gz) ^ sign);
    *distance = q / size;
    return mask8((wide8_min(u, v) >= 0.0f) & (u + v <= size) & (q > r->tmin * size) & (q < t * size));
}

/* The hit record of one triangle of a block, computed again for that one alone. */
inline TriHit wide8_hit(global const float *leaves, uint slot, float t, const Wide8Ray *r)
{
    global const float *b = leaves + (ulong)(slot >> 3) * 88 + (slot & 7);
    float e1x = b[24], e1y = b[32], e1z = b[40], e2x = b[48], e2y = b[56], e2z = b[64];
    float sx = r->ox - b[0], sy = r->oy - b[8], sz = r->oz - b[16];
    float hx = r->dy * e2z - r->dz * e2y;
    float hy = r->dz * e2x - r->dx * e2z;
    float hz = r->dx * e2y - r->dy * e2x;
    float gx = sy * e1z - sz * e1y;
    float gy = sz * e1x - sx * e1z;
    float gz = sx * e1y - sy * e1x;
    float inverse = 1.0f / (e1x * hx + e1y * hy + e1z * hz);
    TriHit hit;
    hit.t = t;
    hit.u = (sx * hx + sy * hy + sz * hz) * inverse;
    hit.v = (r->dx * gx + r->dy * gy + r->dz * gz) * inverse;
    hit.prim = as_uint(b[72]);
    hit.tag = as_uint(b[80]);
    hit.nx = e1y * e2z - e1z * e2y;
    hit.ny = e1z * e2x - e1x * e2z;
    hit.nz = e1x * e2y - e1y * e2x;
    return hit;
}

inline TriHit wide8_closest(global const float *nodes, global const float *leaves, float ox, float oy,
                            float oz, float dx, float dy, float dz, float tmin, float tmax)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return tri_miss(tmax);
    Wide8Ray r = wide8_ray(ox, oy, oz, dx, dy, dz, tmin);
    uint waiting[WIDE8_STACK];
    float entries[WIDE8_STACK];
    uint n = 0, at = 0, best = BVH_MISS;
    float t = tmax;
    for (;;) {
        union { float8 v; float at[8]; } entry;
        Mask8 m = 0;
        while (!(at & BVH_LEAF)) {
            global const float *node = nodes + (ulong)at * 64;
            global const uint *words = (global const uint *)(node + 48);
            m = wide8_boxes((global const float8 *)node, &r, t, &entry.v);
            if (!m) break;
            uint i = mask8_first(m);
            at = words[i];
            m &= m - 1;
            if (!m) continue; /* one child */
            float near = entry.at[i];
            uint base = n;
            do { /* the nearest goes on, the others wait in descending order */
                i = mask8_first(m);
                m &= m - 1;
                uint word = words[i];
                float d = entry.at[i];
                uint closer = d < near, far_word = closer ? at : word;
                float far = closer ? near : d;
                at = closer ? word : at;
                near = closer ? d : near;
                uint k = n++;
                for (; k > base && entries[k - 1] < far; k--) {
                    waiting[k] = waiting[k - 1];
                    entries[k] = entries[k - 1];
                }
                waiting[k] = far_word;
                entries[k] = far;
            } while (m);
            m = 1;
        }
        if (at & BVH_LEAF) {
            uint block = at & ~BVH_LEAF;
            union { float8 v; float at[8]; } q;
            m = wide8_triangles((global const float8 *)(leaves + (ulong)block * 88), &r, t, &q.v);
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
        } while (entries[n] >= t);
        at = waiting[n];
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
    float8 unused;
    for (;;) {
        if (at & BVH_LEAF) {
            global const float *block = leaves + (ulong)(at & ~BVH_LEAF) * 88;
            if (wide8_triangles((global const float8 *)block, &r, tmax, &unused)) return 1;
        } else {
            global const float *node = nodes + (ulong)at * 64;
            global const uint *words = (global const uint *)(node + 48);
            Mask8 m = wide8_boxes((global const float8 *)node, &r, tmax, &unused);
            for (; m; m &= m - 1) waiting[n++] = words[mask8_first(m)];
        }
        if (!n) return 0;
        at = waiting[--n];
    }
}
