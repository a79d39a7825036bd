/* Records of 16 floats for the layouts that test one triangle at a time, in the order of the items.
 *
 * For binary.cl: v0, v1, v2, n, prim, tag, two unused. For brute.cl: v0, e1 = v1 - v0, e2 = v2 - v0,
 * and the rest as before. n = cross(e1, e2).
 */
#include "bvh/build.cl"

inline void pack_record(global float *record, float4 v0, float4 b, float4 c, float4 n, uint prim,
                        uint tag)
{
    vstore4((float4)(v0.xyz, b.x), 0, record);
    vstore4((float4)(b.yz, c.xy), 1, record);
    vstore4((float4)(c.z, n.xyz), 2, record);
    vstore4((float4)(as_float(prim), as_float(tag), 0.0f, 0.0f), 3, record);
}

kernel APART void pack_triangles(global const float8 *restrict items, uint count,
                                 global const float *restrict vertices,
                                 global const uint *restrict faces,
                                 global const uint *restrict tags, uint with_edges,
                                 global float *restrict records)
{
    uint i = get_global_id(0);
    if (i >= count) return;
    uint prim = item_index(items[i]);
    float4 v0 = (float4)(vload3(faces[3 * prim], vertices), 0.0f);
    float4 v1 = (float4)(vload3(faces[3 * prim + 1], vertices), 0.0f);
    float4 v2 = (float4)(vload3(faces[3 * prim + 2], vertices), 0.0f);
    float4 e1 = v1 - v0, e2 = v2 - v0, n = cross(e1, e2);
    global float *record = records + (ulong)i * 16;
    pack_record(record, v0, with_edges ? e1 : v1, with_edges ? e2 : v2, n, prim, tags[prim]);
}

/* The items' indices alone, for trees over shapes that the caller keeps. */
kernel APART void pack_indices(global const float8 *restrict items, uint count,
                               global uint *restrict indices)
{
    uint i = get_global_id(0);
    if (i < count) indices[i] = item_index(items[i]);
}
