/* A binary tree over boxes, top down, by the surface area heuristic with binned centroids (Wald 2007).
 *
 * The children of a range that is cut before item m stand at nodes 2m and 2m + 1: every cut has an m
 * of its own, so work-items need no counter, and two builds make the same tree.
 *
 * The first levels run one kernel a level, one work-item a range; what is left are subtrees, one
 * work-item each. Ranges stand in a binary heap: those under range k are 2k + 1 and 2k + 2.
 */
#include "bvh/apart.cl"
#include "bvh/items.cl"
#include "bvh/node.cl"

#define BUILD_BINS 8

/* What the whole tree shares. */
typedef struct {
    global float8 *items, *nodes;
    float reach;    /* the largest coordinate of the scene */
    uint leaf_size; /* items of a leaf, at most */
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

/* Small ranges are cut with fewer bins: there they cost more than they find. */
inline int build_bins(uint count) { return count > 24 ? BUILD_BINS : 4; }

inline int4 build_bin(float8 item, float4 low, float4 scale)
{
    int4 bin = convert_int4((item.lo - item.hi - low) * scale);
    return clamp(bin, (int4)(0), (int4)(BUILD_BINS - 1));
}

/* The cheapest plane: axis in x, last bin of the left side in y; x < 0 if no plane divides. */
inline int2 build_plane(global const float8 *items, uint first, uint count, float4 low, float4 scale)
{
    int bins = build_bins(count);
    float8 bounds[3][BUILD_BINS];
    uint counts[3][BUILD_BINS];
    for (int axis = 0; axis < 3; axis++)
        for (int k = 0; k < bins; k++) {
            bounds[axis][k] = (float8)(INFINITY);
            counts[axis][k] = 0;
        }
    for (uint i = first; i < first + count; i++) {
        float8 item = items[i];
        int4 bin = build_bin(item, low, scale);
        bounds[0][bin.x] = item_union(bounds[0][bin.x], item);
        bounds[1][bin.y] = item_union(bounds[1][bin.y], item);
        bounds[2][bin.z] = item_union(bounds[2][bin.z], item);
        counts[0][bin.x]++;
        counts[1][bin.y]++;
        counts[2][bin.z]++;
    }
    int2 plane = (int2)(-1, 0);
    float cheapest = INFINITY;
    for (int axis = 0; axis < 3; axis++) {
        float left[BUILD_BINS];
        float8 side = bounds[axis][0];
        uint below = counts[axis][0];
        for (int k = 0; k < bins - 1; k++) {
            left[k] = below ? item_half_area(side) * below : INFINITY;
            side = item_union(side, bounds[axis][k + 1]);
            below += counts[axis][k + 1];
        }
        side = bounds[axis][bins - 1];
        uint above = counts[axis][bins - 1];
        for (int k = bins - 2; k >= 0; k--) {
            float cost = above ? left[k] + item_half_area(side) * above : INFINITY;
            if (cost < cheapest) {
                cheapest = cost;
                plane = (int2)(axis, k);
            }
            side = item_union(side, bounds[axis][k]);
            above += counts[axis][k];
        }
    }
    return plane;
}

/* Moves the items of a range so that its two extents follow each other; returns where the second
 * begins. Where no plane divides, or the depth runs out, it is the middle: then the depth that is
 * left always suffices. */
inline uint build_cut(global float8 *items, Range r, float8 span, Extent *left, Extent *right)
{
    uint mid = r.first;
    uint levels = 32 - clz(r.count - 1); /* of a balanced tree */
    float4 extent = -span.hi - span.lo;
    if (r.depth + levels < BVH_DEPTH) {
        float4 scale = extent > 0.0f ? (build_bins(r.count) * 0.999999f) / extent : (float4)(0.0f);
        int2 plane = build_plane(items, r.first, r.count, span.lo, scale);
        if (plane.x >= 0) {
            uint end = r.first + r.count;
            *left = *right = extent_empty();
            while (mid < end) {
                float8 item = items[mid];
                int4 bin = build_bin(item, span.lo, scale);
                int at = plane.x == 0 ? bin.x : plane.x == 1 ? bin.y : bin.z;
                if (at <= plane.y) {
                    *left = extent_add(*left, item);
                    mid++;
                } else {
                    *right = extent_add(*right, item);
                    end--;
                    items[mid] = items[end];
                    items[end] = item;
                }
            }
        }
    }
    if (mid == r.first || mid == r.first + r.count) {
        mid = r.first + r.count / 2;
        *left = *right = extent_empty();
        for (uint i = r.first; i < mid; i++) *left = extent_add(*left, items[i]);
        for (uint i = mid; i < r.first + r.count; i++) *right = extent_add(*right, items[i]);
    }
    return mid;
}

/* Writes the node of a range; if it is to be divided, does so and returns 1. */
inline int build_range(const Build *b, Range r, Extent h, Range children[2], Extent extents[2])
{
    if (r.count <= b->leaf_size) {
        b->nodes[r.node] = build_node(h.bounds, b->reach, BVH_LEAF | r.first, r.count);
        return 0;
    }
    uint mid = build_cut(b->items, r, h.span, &extents[0], &extents[1]);
    b->nodes[r.node] = build_node(h.bounds, b->reach, 2 * mid, r.count);
    children[0] = (Range){2 * mid, r.first, mid - r.first, r.depth + 1};
    children[1] = (Range){2 * mid + 1, mid, r.first + r.count - mid, r.depth + 1};
    return 1;
}

kernel APART void build_root(global const Extent *restrict parts, uint n_parts, uint count,
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

/* Ranges from `begin` on in the heap, a level of it. Those with no items are no ranges. */
kernel APART void build_level(global float8 *restrict items, global float8 *restrict nodes,
                              global Range *restrict ranges, global Extent *restrict extents,
                              uint begin, uint leaf_size)
{
    uint k = begin + get_global_id(0);
    Build b = {items, nodes, build_reach(extents[0].bounds), leaf_size};
    Range r = ranges[k], children[2] = {{0, 0, 0, 0}, {0, 0, 0, 0}};
    Extent sides[2];
    if (r.count && build_range(&b, r, extents[k], children, sides)) {
        extents[2 * k + 1] = sides[0];
        extents[2 * k + 2] = sides[1];
    }
    ranges[2 * k + 1] = children[0];
    ranges[2 * k + 2] = children[1];
}

kernel APART void build_subtree(global float8 *restrict items, global float8 *restrict nodes,
                                global const Range *restrict ranges,
                                global const Extent *restrict extents, uint begin, uint leaf_size)
{
    Build b = {items, nodes, build_reach(extents[0].bounds), leaf_size};
    Range waiting[BVH_DEPTH];
    Extent waiting_halves[BVH_DEPTH];
    int n = 0;
    Range r = ranges[begin + get_global_id(0)], children[2];
    Extent h = extents[begin + get_global_id(0)], sides[2];
    while (r.count) {
        if (build_range(&b, r, h, children, sides)) {
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
