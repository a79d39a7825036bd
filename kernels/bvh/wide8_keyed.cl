/* Traversal of an 8-wide tree over moving vertices, see bvh/keyed.cl and bvh/wide8.cl. The words of nodes count nodes
 * and blocks of all keys. */
#include "bvh/wide8.cl"
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
