/* Triangle records of leaves for traversals, from vertices and faces.
 *
 * A triangle with a corner that is not finite, or beyond what trees hold, is stored as a point, which
 * nothing hits.
 */
#include "bvh/ray.cl"

#include "generated/tree_reaches.cl"

/* The corners of a triangle; returns 0 if they became a point. */
inline int leaf_corners(global const float *vertices, global const uint *faces, uint prim,
                        float4 corners[3])
{
    int4 near = (int4)(-1);
    for (uint i = 0; i < 3; i++) {
        corners[i] = (float4)(vload3(faces[3 * prim + i], vertices), 0.0f);
        near &= fabs(corners[i]) < BVH_REACH; /* NaN fails the comparison */
    }
    if (all(near)) return 1;
    corners[0] = corners[1] = corners[2] = (float4)(0.0f);
    return 0;
}

/* For bvh/binary.cl, 16 floats: v0, v1, v2, n = cross(v1 - v0, v2 - v0); then prim, tag, plane, side. */
inline void leaf_store_record(global float *record, const float4 v[3])
{
    float4 e1 = v[1] - v[0], e2 = v[2] - v[0], n = cross(e1, e2);
    vstore4((float4)(v[0].xyz, v[1].x), 0, record);
    vstore4((float4)(v[1].yz, v[2].xy), 1, record);
    vstore4((float4)(v[2].z, n.xyz), 2, record);
    vstore2((float2)(dot(n, v[0]), tri_side(e1.xyz, e2.xyz)), 7, record);
}

/* For bvh/brute.cl, 16 floats: v0, e1, e2, n = cross(e1, e2); then prim, tag, plane, side. */
inline void leaf_store_brute(global float *record, const float4 v[3])
{
    float4 e1 = v[1] - v[0], e2 = v[2] - v[0], n = cross(e1, e2);
    vstore4((float4)(v[0].xyz, e1.x), 0, record);
    vstore4((float4)(e1.yz, e2.xy), 1, record);
    vstore4((float4)(e2.z, n.xyz), 2, record);
    vstore2((float2)(dot(n, v[0]), tri_side(e1.xyz, e2.xyz)), 7, record);
}

inline float leaf_least(float8 row)
{
    float4 l = row.lo < row.hi ? row.lo : row.hi;
    float2 m = l.lo < l.hi ? l.lo : l.hi;
    return m.x < m.y ? m.x : m.y;
}

inline float8 leaf_min(float8 a, float8 b, float8 c) { float8 m = a < b ? a : b; return m < c ? m : c; }

#define LEAF_ROW(p, axis) \
    (float8)(p[0].axis, p[1].axis, p[2].axis, p[3].axis, p[4].axis, p[5].axis, p[6].axis, p[7].axis)

/* A block of bvh/wide8.cl, 11 rows of float8: v0, v1, v2 (x, y, z each), prim, tag; the last two are filled already.
 * Slots beyond its triangles have prim = BVH_MISS and hold a point. Returns low corner and negated high corner,
 * FLT_MAX for an empty block. */
inline float8 leaf_store_block(global float *block, global const float *vertices,
                               global const uint *faces)
{
    global float8 *rows = (global float8 *)block;
    global const uint *prims = (global const uint *)(rows + 9);
    float3 a[8], b[8], c[8];
    for (uint k = 0; k < 8; k++) {
        uint there = prims[k] != BVH_MISS; /* elsewhere three times a corner of the first */
        global const uint *face = faces + 3 * (ulong)prims[k * there];
        a[k] = vload3(face[0], vertices);
        b[k] = vload3(face[there], vertices);
        c[k] = vload3(face[2 * there], vertices);
    }
    float8 v[9] = {LEAF_ROW(a, x), LEAF_ROW(a, y), LEAF_ROW(a, z), LEAF_ROW(b, x), LEAF_ROW(b, y),
                   LEAF_ROW(b, z), LEAF_ROW(c, x), LEAF_ROW(c, y), LEAF_ROW(c, z)};
    int8 sound = (int8)(-1);
    for (uint i = 0; i < 9; i++) sound &= fabs(v[i]) < BVH_REACH; /* NaN fails the comparison */
    if (!all(sound)) { /* invalid triangles become a point of a valid triangle */
        union { float8 row[3]; float at[24]; } corner = {{v[0], v[1], v[2]}};
        union { int8 row; int at[8]; } usable = {sound};
        uint k = 0;
        while (k < 8 && !usable.at[k]) k++;
        for (uint i = 0; i < 9; i++)
            v[i] = select((float8)(k < 8 ? corner.at[8 * (i % 3) + k] : 0.0f), v[i], sound);
    }
    for (uint i = 0; i < 9; i++) rows[i] = v[i];
    if (!any(sound)) return (float8)(FLT_MAX);
    float8 bounds;
    bounds.s0 = leaf_least(leaf_min(v[0], v[3], v[6]));
    bounds.s1 = leaf_least(leaf_min(v[1], v[4], v[7]));
    bounds.s2 = leaf_least(leaf_min(v[2], v[5], v[8]));
    bounds.s4 = leaf_least(leaf_min(-v[0], -v[3], -v[6]));
    bounds.s5 = leaf_least(leaf_min(-v[1], -v[4], -v[7]));
    bounds.s6 = leaf_least(leaf_min(-v[2], -v[5], -v[8]));
    bounds.s3 = bounds.s7 = 0.0f;
    return bounds;
}
