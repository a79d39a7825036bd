/* Items from triangles and boxes, and traversals' records from items; bvh/leaves.cl has the records. */
#include "bvh/hints.cl"
#include "bvh/node.cl"
#include "bvh/leaves.cl"

/* A work-item handles `run` neighbours and writes their bounds to `extents`. */
kernel NO_VECTORIZE void items_of_triangles(global const float *restrict vertices,
                                  global const uint *restrict faces, uint count, uint run,
                                  global float8 *restrict items, global Extent *restrict extents)
{
    uint begin = get_global_id(0) * run, end = min(begin + run, count);
    if (begin >= count) return;
    Extent h = extent_empty();
    for (uint i = begin; i < end; i++) {
        float4 v[3];
        leaf_corners(vertices, faces, i, v);
        float area = length(cross(v[1] - v[0], v[2] - v[0])); /* both sides */
        float4 lo = v[0] < v[1] ? v[0] : v[1], hi = v[0] > v[1] ? v[0] : v[1];
        float8 item = item_make(lo < v[2] ? lo : v[2], hi > v[2] ? hi : v[2], i, area);
        items[i] = item;
        h = extent_add(h, item);
    }
    extents[get_global_id(0)] = h;
}

/* The same for boxes with a low and a high corner; their content counts as an ellipsoid. */
kernel NO_VECTORIZE void items_of_boxes(global const float *restrict boxes, uint count, uint run,
                              global float8 *restrict items, global Extent *restrict extents)
{
    uint begin = get_global_id(0) * run, end = min(begin + run, count);
    if (begin >= count) return;
    Extent h = extent_empty();
    for (uint i = begin; i < end; i++) {
        float4 lo = (float4)(vload3(2 * i, boxes), 0.0f), hi = (float4)(vload3(2 * i + 1, boxes), 0.0f);
        float8 item = item_make(lo, hi, i, item_half_area((float8)(lo, -hi)));
        items[i] = item;
        h = extent_add(h, item);
    }
    extents[get_global_id(0)] = h;
}

kernel NO_VECTORIZE void pack_triangles(global const float8 *restrict items, uint count,
                                        global const float *restrict vertices,
                                        global const uint *restrict faces,
                                        global const uint *restrict tags, global float *restrict records)
{
    uint i = get_global_id(0);
    if (i >= count) return;
    uint prim = item_index(items[i]);
    float4 corners[3];
    global float *record = records + (ulong)i * 16;
    leaf_corners(vertices, faces, prim, corners);
    leaf_store_record(record, corners);
    vstore2((float2)(as_float(prim), as_float(tags[prim])), 6, record);
}

/* The items' indices, for trees over shapes that the caller keeps. */
kernel NO_VECTORIZE void pack_indices(global const float8 *restrict items, uint count,
                                      global uint *restrict indices)
{
    uint i = get_global_id(0);
    if (i < count) indices[i] = item_index(items[i]);
}
