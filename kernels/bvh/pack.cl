/* From triangles and boxes to items, and from items to what traversals read.
 *
 * binary.cl's triangle records are 16 floats, in the order of the items: v0, v1, v2,
 * n = cross(v1 - v0, v2 - v0), prim, tag, two unused.
 */
#include "bvh/apart.cl"
#include "bvh/items.cl"

/* One work-item takes `run` neighbours and leaves the bounds of all of them in `extents`. */
kernel APART void items_of_triangles(global const float *restrict vertices,
                                  global const uint *restrict faces, uint count, uint run,
                                  global float8 *restrict items, global Extent *restrict extents)
{
    uint begin = get_global_id(0) * run, end = min(begin + run, count);
    Extent h = extent_empty();
    for (uint i = begin; i < end; i++) {
        float4 a = (float4)(vload3(faces[3 * i], vertices), 0.0f);
        float4 b = (float4)(vload3(faces[3 * i + 1], vertices), 0.0f);
        float4 c = (float4)(vload3(faces[3 * i + 2], vertices), 0.0f);
        float area = length(cross(b - a, c - a)); /* both sides */
        float8 item = item_make(fmin(a, fmin(b, c)), fmax(a, fmax(b, c)), i, area);
        items[i] = item;
        h = extent_add(h, item);
    }
    extents[get_global_id(0)] = h;
}

/* The same for boxes given as low and high corner; what is inside is taken for an ellipsoid. */
kernel APART void items_of_boxes(global const float *restrict boxes, uint count, uint run,
                              global float8 *restrict items, global Extent *restrict extents)
{
    uint begin = get_global_id(0) * run, end = min(begin + run, count);
    Extent h = extent_empty();
    for (uint i = begin; i < end; i++) {
        float4 lo = (float4)(vload3(2 * i, boxes), 0.0f), hi = (float4)(vload3(2 * i + 1, boxes), 0.0f);
        float8 item = item_make(lo, hi, i, item_half_area((float8)(lo, -hi)));
        items[i] = item;
        h = extent_add(h, item);
    }
    extents[get_global_id(0)] = h;
}

kernel APART void pack_triangles(global const float8 *restrict items, uint count,
                                 global const float *restrict vertices,
                                 global const uint *restrict faces,
                                 global const uint *restrict tags, global float *restrict records)
{
    uint i = get_global_id(0);
    if (i >= count) return;
    uint prim = item_index(items[i]);
    float4 v0 = (float4)(vload3(faces[3 * prim], vertices), 0.0f);
    float4 v1 = (float4)(vload3(faces[3 * prim + 1], vertices), 0.0f);
    float4 v2 = (float4)(vload3(faces[3 * prim + 2], vertices), 0.0f);
    float4 n = cross(v1 - v0, v2 - v0);
    vstore4((float4)(v0.xyz, v1.x), 4 * i, records);
    vstore4((float4)(v1.yz, v2.xy), 4 * i + 1, records);
    vstore4((float4)(v2.z, n.xyz), 4 * i + 2, records);
    vstore4((float4)(as_float(prim), as_float(tags[prim]), 0.0f, 0.0f), 4 * i + 3, records);
}

/* The items' indices alone, for trees over shapes that the caller keeps. */
kernel APART void pack_indices(global const float8 *restrict items, uint count,
                               global uint *restrict indices)
{
    uint i = get_global_id(0);
    if (i < count) indices[i] = item_index(items[i]);
}
