/* Sums over the work-items of a group, of any size from 1 on, and over a buffer. */

/* Replaces each work-item's value by the sum before it, and returns the sum of all. sums: a value for each
 * work-item. */
inline uint2 scan_group(local uint2 *sums, uint2 *value)
{
    uint k = get_local_id(0), size = get_local_size(0);
    uint2 before = *value;
    sums[k] = before;
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint step = 1; step < size; step <<= 1) { /* Hillis and Steele 1986 */
        uint2 more = k >= step ? sums[k - step] : (uint2)(0);
        barrier(CLK_LOCAL_MEM_FENCE);
        sums[k] += more;
        barrier(CLK_LOCAL_MEM_FENCE);
    }
    *value = sums[k] - before;
    uint2 all = sums[size - 1];
    barrier(CLK_LOCAL_MEM_FENCE);
    return all;
}

/* A work-item's share of `count` values: from x up to y. */
inline uint2 scan_share(uint count)
{
    uint size = get_local_size(0), lane = get_local_id(0), share = (count + size - 1) / size;
    uint begin = min(lane * share, count);
    return (uint2)(begin, min(begin + share, count));
}

/* A work-item's share of its group's tile, up to `count`: from x up to y. Groups beyond the last tile have none. */
inline uint2 scan_tile(uint tile, uint count)
{
    uint group = min((uint)get_group_id(0), count / tile + 1); /* the product stays in 32 bits */
    return min(scan_share(tile) + (uint2)(group * tile), (uint2)(count));
}

/* Step sums: kernels of their own. */
#include "bvh/hints.cl"
#include "bvh/node.cl"

/* Replaces numbers by the sums before them, in a single group; the sum of all follows the last. */
kernel NO_VECTORIZE void scan_sums(global uint *restrict numbers, uint count, local uint2 *sums)
{
    uint2 share = scan_share(count), sum = (uint2)(0);
    for (uint i = share.x; i < share.y; i++) sum.x += numbers[i];
    uint all = scan_group(sums, &sum).x;
    for (uint i = share.x; i < share.y; i++) {
        uint number = numbers[i];
        numbers[i] = sum.x;
        sum.x += number;
    }
    if (get_local_id(0) == 0) numbers[count] = all;
}

/* The bounds of `run` neighbours of an array of bounds. */
kernel NO_VECTORIZE void scan_extents(global const Extent *restrict parts, uint count, uint run,
                                      global Extent *restrict extents)
{
    uint begin = get_global_id(0) * run;
    if (begin >= count) return;
    Extent h = extent_empty();
    for (uint i = begin; i < min(begin + run, count); i++) {
        h.bounds = item_union(h.bounds, parts[i].bounds);
        h.span = item_union(h.span, parts[i].span);
    }
    extents[get_global_id(0)] = h;
}
