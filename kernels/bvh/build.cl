/* A binary tree over boxes, top down, by the surface area heuristic with binned centroids (Wald 2007).
 *
 * Each of the first levels has a kernel launch, with a work-item a range. Then each subtree has a work-item.
 * Ranges form a binary heap: the children of range k are 2k + 1 and 2k + 2.
 *
 * The children of a range that is split before item m are nodes 2m and 2m + 1. A subtree's nodes follow each
 * other from its first split on, so that neighbours share cache lines and pages. No counter is shared, so two
 * builds give the same tree.
 */
#include "bvh/hints.cl"
#include "bvh/node.cl"
#include "bvh/node.cl"

#define BUILD_BINS 8

/* Parameters of the whole tree. */
typedef struct {
    global float8 *items, *nodes;
    float reach;    /* the largest coordinate of the scene */
    uint leaf_size; /* the most items of a leaf */
    uint at_once;   /* log2 of the items that a traversal tests at once */
    uint runs;      /* whether items are runs of bvh/curve.cl, and become leaves */
    uint depth;     /* the most levels below the root */
} Build;

inline float build_reach(float8 scene)
{
    float4 reach = fmax(fabs(scene.lo), fabs(scene.hi));
    return fmax(reach.x, fmax(reach.y, reach.z));
}

inline float8 build_node(float8 bounds, float reach, uint link, uint count)
{
    return node_make(node_pad(bounds, reach), link, count);
}

/* Small ranges have fewer bins: more bins cost more than they gain. */
inline uint build_bins(uint count) { return count > 12 ? BUILD_BINS : 4; }

inline int4 build_bin(float8 item, float4 low, float4 scale)
{
    int4 bin = convert_int4((item.lo - item.hi - low) * scale);
    return clamp(bin, (int4)(0), (int4)(BUILD_BINS - 1));
}

/* The cost of `count` items in a box. The area of an empty side is no number. */
inline float build_cost(const Build *b, float8 bounds, uint count)
{
    return item_half_area(bounds) * (int)((count + (1u << b->at_once) - 1) >> b->at_once);
}

/* Adds an item to its bin of each axis, and to the bins' counts, 8 bits a bin. */
inline void build_put(float8 bounds[BUILD_BINS][3], ulong4 *numbers, float8 item, float4 low, float4 scale)
{
    int4 bin = build_bin(item, low, scale);
    *numbers += (ulong4)(1) << convert_ulong4(8 * bin);
    bounds[bin.x][0] = item_union(bounds[bin.x][0], item);
    bounds[bin.y][1] = item_union(bounds[bin.y][1], item);
    bounds[bin.z][2] = item_union(bounds[bin.z][2], item);
}

/* The cheapest plane: axis in x, last bin of the left side in y; x < 0 if no plane divides.
 *
 * Odd items have a second set of bins: neighbours tend to fall into the same bin, and a load after a recent
 * store is slow. */
inline int2 build_plane(const Build *b, uint first, uint count, float4 low, float4 scale)
{
    uint bins = build_bins(count), end = first + count;
    float8 bounds[BUILD_BINS][3], others[BUILD_BINS][3];
    uint counts[BUILD_BINS][3];
    for (uint k = 0; k < bins; k++)
        for (int axis = 0; axis < 3; axis++) {
            bounds[k][axis] = others[k][axis] = (float8)(INFINITY);
            counts[k][axis] = 0;
        }
    for (uint i = first; i < end;) {
        ulong4 numbers = (ulong4)(0);
        for (uint until = min(i + 254, end); i < until; i += 2) {
            build_put(bounds, &numbers, b->items[i], low, scale);
            if (i + 1 < until) build_put(others, &numbers, b->items[i + 1], low, scale);
        }
        for (uint k = 0; k < bins; k++) {
            counts[k][0] += numbers.x >> 8 * k & 255;
            counts[k][1] += numbers.y >> 8 * k & 255;
            counts[k][2] += numbers.z >> 8 * k & 255;
        }
    }
    for (uint k = 0; k < bins; k++)
        for (int axis = 0; axis < 3; axis++)
            bounds[k][axis] = item_union(bounds[k][axis], others[k][axis]);
    int2 plane = (int2)(-1, 0);
    float cheapest = INFINITY;
    for (int axis = 0; axis < 3; axis++) {
        float left[BUILD_BINS];
        float8 side = bounds[0][axis];
        uint on_side = counts[0][axis];
        for (uint k = 0; k < bins - 1; k++) {
            left[k] = build_cost(b, side, on_side);
            side = item_union(side, bounds[k + 1][axis]);
            on_side += counts[k + 1][axis];
        }
        side = bounds[bins - 1][axis];
        on_side = counts[bins - 1][axis];
        for (int k = bins - 2; k >= 0; k--) {
            float cost = left[k] + build_cost(b, side, on_side);
            if (cost < cheapest) { /* NaN fails the comparison */
                cheapest = cost;
                plane = (int2)(axis, k);
            }
            side = item_union(side, bounds[k][axis]);
            on_side += counts[k][axis];
        }
    }
    return plane;
}

/* Moves the items of a range with a bin up to `last` to its front; returns the start of the others. For the other
 * side an item becomes NaN, which a union ignores. */
inline uint build_divide(global float8 *items, Range r, int axis, int last, float8 span, float4 scale,
                         Extent *left, Extent *right)
{
    global const float *corner = (global const float *)(items + r.first) + axis;
    float low = axis == 0 ? span.s0 : axis == 1 ? span.s1 : span.s2;
    float per = axis == 0 ? scale.x : axis == 1 ? scale.y : scale.z, least = last + 1;
    uint mid = r.first;
    *left = *right = extent_empty();
    for (uint i = r.first; i < r.first + r.count; i++, corner += 8) {
        float8 item = items[i], centroid = item_centroid(item);
        float at = (corner[0] - corner[4] - low) * per; /* as in build_bin */
        int beyond = at >= least;
        int8 not_left = (int8)(-beyond), not_right = (int8)(beyond - 1);
        items[i] = items[mid];
        items[mid] = item;
        mid += 1 - beyond;
        left->bounds = item_union(as_float8(as_int8(item) | not_left), left->bounds);
        left->span = item_union(as_float8(as_int8(centroid) | not_left), left->span);
        right->bounds = item_union(as_float8(as_int8(item) | not_right), right->bounds);
        right->span = item_union(as_float8(as_int8(centroid) | not_right), right->span);
    }
    return mid;
}

/* Splits the items of a range; returns the start of the second part. Where no plane divides, or the depth runs out,
 * it is the middle: the remaining depth then suffices. */
inline uint build_cut(const Build *b, Range r, float8 span, Extent *left, Extent *right)
{
    uint mid = r.first;
    uint levels = 32 - clz(r.count - 1); /* of a balanced tree */
    float4 extent = -span.hi - span.lo;
    if (r.depth + levels < b->depth) {
        float4 scale = extent > 0.0f ? (build_bins(r.count) * 0.999999f) / extent : (float4)(0.0f);
        int2 plane = build_plane(b, r.first, r.count, span.lo, scale);
        if (plane.x >= 0) mid = build_divide(b->items, r, plane.x, plane.y, span, scale, left, right);
    }
    if (mid == r.first || mid == r.first + r.count) {
        mid = r.first + r.count / 2;
        *left = *right = extent_empty();
        for (uint i = r.first; i < mid; i++) *left = extent_add(*left, b->items[i]);
        for (uint i = mid; i < r.first + r.count; i++) *right = extent_add(*right, b->items[i]);
    }
    return mid;
}

/* Writes the node of a range; splits the range if necessary and returns 1 then. next: the children's node, or 0: by
 * the position of the split. */
inline int build_range(const Build *b, Range r, Extent h, uint next, Range children[2], Extent extents[2])
{
    if (r.count <= b->leaf_size) {
        uint first = r.first, count = r.count;
        if (b->runs) {
            float8 run = b->items[first];
            first = item_index(run);
            count = run.s7;
        }
        b->nodes[r.node] = build_node(h.bounds, b->reach, BVH_LEAF | first, count);
        return 0;
    }
    uint mid = build_cut(b, r, h.span, &extents[0], &extents[1]);
    next = next ? next : 2 * mid;
    b->nodes[r.node] = build_node(h.bounds, b->reach, next, r.count);
    children[0] = (Range){next, r.first, mid - r.first, r.depth + 1};
    children[1] = (Range){next + 1, mid, r.first + r.count - mid, r.depth + 1};
    return 1;
}

kernel NO_VECTORIZE void build_root(global const Extent *restrict parts, uint n_parts, uint count,
                                    global Range *restrict ranges, global Extent *restrict extents)
{
    Extent h = extent_empty();
    for (uint i = 0; i < n_parts; i++) {
        h.bounds = item_union(h.bounds, parts[i].bounds);
        h.span = item_union(h.span, parts[i].span);
    }
    ranges[0] = (Range){0, 0, count, 0};
    extents[0] = h;
}

/* A level of the heap, from range `begin` on. Empty ranges do nothing. */
kernel NO_VECTORIZE void build_level(global float8 *restrict items, global float8 *restrict nodes,
                                     global Range *restrict ranges, global Extent *restrict extents,
                                     uint begin, uint leaf_size, uint at_once, uint runs, uint depth)
{
    uint k = begin + get_global_id(0);
    Build b = {items, nodes, build_reach(extents[0].bounds), leaf_size, at_once, runs, depth};
    Range r = ranges[k], children[2] = {{0, 0, 0, 0}, {0, 0, 0, 0}};
    Extent sides[2];
    if (r.count && build_range(&b, r, extents[k], 0, children, sides)) {
        extents[2 * k + 1] = sides[0];
        extents[2 * k + 2] = sides[1];
    }
    ranges[2 * k + 1] = children[0];
    ranges[2 * k + 2] = children[1];
}

kernel NO_VECTORIZE void build_subtree(global float8 *restrict items, global float8 *restrict nodes,
                                       global const Range *restrict ranges,
                                       global const Extent *restrict extents, uint begin, uint leaf_size,
                                       uint at_once, uint runs, uint depth)
{
    Build b = {items, nodes, build_reach(extents[0].bounds), leaf_size, at_once, runs, depth};
    Range waiting[BVH_DEPTH];
    Extent waiting_halves[BVH_DEPTH];
    int n = 0;
    Range r = ranges[begin + get_global_id(0)], children[2];
    Extent h = extents[begin + get_global_id(0)], sides[2];
    uint next = 2 * (r.first + 1);
    while (r.count) {
        if (build_range(&b, r, h, next, children, sides)) {
            next += 2;
            waiting[n] = children[1];
            waiting_halves[n++] = sides[1];
            r = children[0];
            h = sides[0];
        } else if (n) {
            r = waiting[--n];
            h = waiting_halves[n];
        } else {
            return;
        }
    }
}
