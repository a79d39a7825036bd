/* Triangle records for the layouts that test one triangle at a time: 16 floats, v0, e1 = v1 - v0,
 * e2 = v2 - v0, n = cross(e1, e2), prim, tag, two unused; in the order of the items.
 */
#include "bvh/build.cl"

kernel void pack_triangles(global const float8 *restrict items, uint count,
                           global const float *restrict vertices, global const uint *restrict faces,
                           global const uint *restrict tags, global float *restrict records)
{
    uint i = get_global_id(0);
    if (i >= count) return;
    uint prim = item_index(items[i]);
    float4 v0 = (float4)(vload3(faces[3 * prim], vertices), 0.0f);
    float4 e1 = (float4)(vload3(faces[3 * prim + 1], vertices), 0.0f) - v0;
    float4 e2 = (float4)(vload3(faces[3 * prim + 2], vertices), 0.0f) - v0;
    float4 n = cross(e1, e2);
    vstore4((float4)(v0.xyz, e1.x), 4 * i, records);
    vstore4((float4)(e1.yz, e2.xy), 4 * i + 1, records);
    vstore4((float4)(e2.z, n.xyz), 4 * i + 2, records);
    vstore4((float4)(as_float(prim), as_float(tags[prim]), 0.0f, 0.0f), 4 * i + 3, records);
}

/* The items' indices alone, for trees over shapes that the caller keeps. */
kernel void pack_indices(global const float8 *restrict items, uint count, global uint *restrict indices)
{
    uint i = get_global_id(0);
    if (i < count) indices[i] = item_index(items[i]);
}
