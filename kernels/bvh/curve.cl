/* Leaves without a search for planes: items in the order of a space-filling curve, cut into runs as leaves.
 *
 * It is Morton's curve through nearly cubic cells, from 33 halvings of the longest side. bvh/sort.cl sorts the
 * keys stably, so that two builds give the same tree. Dynamic programming finds the cut of a stretch
 * into runs of at most `leaf_size` items with the least sum of the boxes' areas.
 *
 * A key is Morton's code above the item's index. An item represents a run for the build of a tree: its name is
 * the run's first item, and its area is replaced by the number of items.
 */
#include "bvh/hints.cl"
#include "bvh/node.cl"

#include "generated/curve_keys.cl"
#define CURVE_AHEAD 16 /* items */
#define CURVE_SHARE 0.2f /* share of the last eight items' area: the cost of another leaf */
#define CURVE_FAR 1e37f /* more than any sum of areas */

/* The bits of a cell's coordinate at their positions in the code, byte by byte. */
inline ulong curve_spread(global const ulong *table, int cell) { return table[cell & 255] | table[256 + (cell >> 8)]; }

/* low, scale: from a doubled centroid to its cell; tables: of two bytes of each axis. */
kernel NO_VECTORIZE void curve_keys(global const float8 *restrict items, uint count, float4 low, float4 scale,
                                    global const ulong *restrict tables, global ulong *restrict keys)
{
    uint i = get_global_id(0);
    if (i >= count) return;
    int4 cell = convert_int4((items[i].lo - items[i].hi - low) * scale);
    cell = clamp(cell, (int4)(0), (int4)(65535));
    ulong code = curve_spread(tables, cell.x) | curve_spread(tables + 512, cell.y) |
                 curve_spread(tables + 1024, cell.z);
    keys[i] = code << CURVE_INDEX | i;
}

inline uint curve_item(ulong key) { return key & (1ul << CURVE_INDEX) - 1; }

/* Lanes moved up by a lane, with another value in the first. */
inline float8 curve_shift(float8 v, float first)
{
    v = v.s70123456;
    v.s0 = first;
    return v;
}

/* The bounds of the last 1 .. 8 items, with another item. */
inline float8 curve_widen(float8 last, float next) { return item_union(curve_shift(last, INFINITY), (float8)(next)); }

/* Puts `run` items in order, and finds for each the length of the run that ends with it, 0 without; counts the
 * runs. */
kernel NO_VECTORIZE void curve_cut(global const float8 *restrict items, global const ulong *restrict keys,
                                   uint count, uint run, uint leaf_size, global float8 *restrict sorted,
                                   global uchar *restrict lengths, global uint *restrict numbers)
{
    uint begin = get_global_id(0) * run, end = min(begin + run, count);
    if (begin >= count) return;
    const int8 lanes = (int8)(0, 1, 2, 3, 4, 5, 6, 7); /* lane k: the cost with a last run of k + 1 items */
    const float8 limit = lanes < (int8)(leaf_size) ? (float8)(0.0f) : (float8)(CURVE_FAR);
    float8 x = (float8)(INFINITY), y = x, z = x, to_x = x, to_y = x, to_z = x;
    float8 before = (float8)(CURVE_FAR); /* the least cost before the run, less the cost with an item less */
    before.s0 = 0.0f;
    for (uint i = begin; i < end; i++) {
        FETCH(items + curve_item(keys[min(i + CURVE_AHEAD, count - 1)]));
        float8 item = items[curve_item(keys[i])];
        sorted[i] = item;
        x = curve_widen(x, item.s0);
        y = curve_widen(y, item.s1);
        z = curve_widen(z, item.s2);
        to_x = curve_widen(to_x, item.s4);
        to_y = curve_widen(to_y, item.s5);
        to_z = curve_widen(to_z, item.s6);
        float8 dx = -to_x - x, dy = -to_y - y, dz = -to_z - z;
        float8 area = dx * dy + dy * dz + dz * dx;
        float8 cost = before + area + CURVE_SHARE * area.s7 + limit;
        cost = as_float8((as_int8(cost) & ~7) | 7 - lanes); /* so that the least value tells its lane */
        float4 four = cost.lo < cost.hi ? cost.lo : cost.hi;
        float2 two = four.lo < four.hi ? four.lo : four.hi;
        float least = two.x < two.y ? two.x : two.y;
        lengths[i] = min(8 - (as_uint(least) & 7), min(leaf_size, i - begin + 1)); /* were it NaN */
        before = curve_shift(before - least, 0.0f);
    }
    uint number = 0;
    for (uint i = end; i > begin; i -= lengths[i - 1]) number++;
    numbers[get_global_id(0)] = number;
}

/* Writes the items of runs; numbers: the first run of each stretch. */
kernel NO_VECTORIZE void curve_runs(global const float8 *restrict sorted, uint count, uint run,
                                    global const uchar *restrict lengths, global const uint *restrict numbers,
                                    global float8 *restrict runs, global Extent *restrict extents)
{
    uint begin = get_global_id(0) * run, end = min(begin + run, count);
    if (begin >= count) return;
    uint at = numbers[get_global_id(0) + 1];
    Extent h = extent_empty();
    for (uint i = end; i > begin;) {
        uint length = lengths[i - 1];
        float8 bounds = (float8)(INFINITY);
        for (uint k = 0; k < length; k++) bounds = item_union(bounds, sorted[--i]);
        float8 item = item_make(bounds.lo, -bounds.hi, i, (float)length);
        runs[--at] = item;
        h = extent_add(h, item);
    }
    extents[get_global_id(0)] = h;
}
