/* A binary tree over boxes, top down, by the surface area heuristic with binned centroids (Wald 2007).
 *
 * Items are float8: low corner, name, negated high corner, surface area of what is inside; so the
 * union of two boxes is one minimum. An item's name is its index with BVH_ITEM set, which keeps the
 * bits away from denormals and NaN.
 *
 * The children of a range that is cut before item m stand at nodes 2m and 2m + 1: every cut has an m
 * of its own, so work-items need no counter, and two builds make the same tree.
 *
 * The first levels run one kernel a level, one work-item a range; what is left are subtrees, one
 * work-item each. Ranges stand in a binary heap: those under range k are 2k + 1 and 2k + 2.
 */
#include "bvh/apart.cl"
#include "bvh/node.cl"

#define BVH_ITEM 0x40000000u
#define BUILD_BINS 8

/* What the whole tree shares. */
typedef struct {
    global float8 *items, *nodes;
    float reach;    /* the largest coordinate of the scene */
    uint leaf_size; /* items of a leaf, at most */
} Build;

typedef struct { uint node, first, count, depth; } Range;

/* A half range: its bounds, and its span: the minimum of (centroid, -centroid). */
typedef struct { float8 bounds, span; } Half;

inline float8 build_union(float8 a, float8 b) { return a < b ? a : b; }

/* Twice the centroid, and its negation; the fourth lanes mean nothing. */
inline float8 build_centroid(float8 item)
{
    float4 c = item.lo - item.hi;
    return (float8)(c, -c);
}

inline Half build_empty(void)
{
    Half h = {(float8)(INFINITY), (float8)(INFINITY)};
    return h;
}

inline Half build_add(Half h, float8 item)
{
    h.bounds = build_union(h.bounds, item);
    h.span = build_union(h.span, build_centroid(item));
    return h;
}

inline float build_half_area(float8 bounds)
{
    float4 e = -bounds.hi - bounds.lo;
    return e.x * e.y + e.y * e.z + e.z * e.x;
}

inline float8 build_item(float4 lo, float4 hi, uint index, float area)
{
    lo.w = as_float(BVH_ITEM | index);
    hi.w = -area;
    return (float8)(lo, -hi);
}

inline uint item_index(float8 item) { return as_uint(item.s3) & ~BVH_ITEM; }

inline float build_reach(float8 scene)
{
    float4 reach = fmax(fabs(scene.lo), fabs(scene.hi));
    return fmax(reach.x, fmax(reach.y, reach.z));
}

/* Nodes are larger than what they hold by an ulp or two, and a trifle where a coordinate is 0: rays in
 * the very plane of a side, whose direction has no component across it, are inside. */
inline float8 build_node(float8 bounds, float reach, uint link, uint count)
{
    float4 lo = bounds.lo - fabs(bounds.lo) * 0x1p-22f - reach * 0x1p-40f;
    float4 hi = -bounds.hi + fabs(bounds.hi) * 0x1p-22f + reach * 0x1p-40f;
    lo.w = as_float(link);
    hi.w = as_float(count);
    return (float8)(lo, hi);
}

/* --- items --- */

/* One work-item takes `run` neighbours and leaves the bounds of all of them in `halves`. */
kernel APART void build_triangles(global const float *restrict vertices,
                                  global const uint *restrict faces, uint count, uint run,
                                  global float8 *restrict items, global Half *restrict halves)
{
    uint begin = get_global_id(0) * run, end = min(begin + run, count);
    Half h = build_empty();
    for (uint i = begin; i < end; i++) {
        float4 a = (float4)(vload3(faces[3 * i], vertices), 0.0f);
        float4 b = (float4)(vload3(faces[3 * i + 1], vertices), 0.0f);
        float4 c = (float4)(vload3(faces[3 * i + 2], vertices), 0.0f);
        float area = length(cross(b - a, c - a)); /* both sides */
        float8 item = build_item(fmin(a, fmin(b, c)), fmax(a, fmax(b, c)), i, area);
        items[i] = item;
        h = build_add(h, item);
    }
    halves[get_global_id(0)] = h;
}

/* The same for boxes given as low and high corner; what is inside is taken for an ellipsoid. */
kernel APART void build_boxes(global const float *restrict boxes, uint count, uint run,
                              global float8 *restrict items, global Half *restrict halves)
{
    uint begin = get_global_id(0) * run, end = min(begin + run, count);
    Half h = build_empty();
    for (uint i = begin; i < end; i++) {
        float4 lo = (float4)(vload3(2 * i, boxes), 0.0f), hi = (float4)(vload3(2 * i + 1, boxes), 0.0f);
        float8 item = build_item(lo, hi, i, build_half_area((float8)(lo, -hi)));
        items[i] = item;
        h = build_add(h, item);
    }
    halves[get_global_id(0)] = h;
}

/* --- cutting a range --- */

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
        bounds[0][bin.x] = build_union(bounds[0][bin.x], item);
        bounds[1][bin.y] = build_union(bounds[1][bin.y], item);
        bounds[2][bin.z] = build_union(bounds[2][bin.z], item);
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
            left[k] = below ? build_half_area(side) * below : INFINITY;
            side = build_union(side, bounds[axis][k + 1]);
            below += counts[axis][k + 1];
        }
        side = bounds[axis][bins - 1];
        uint above = counts[axis][bins - 1];
        for (int k = bins - 2; k >= 0; k--) {
            float cost = above ? left[k] + build_half_area(side) * above : INFINITY;
            if (cost < cheapest) {
                cheapest = cost;
                plane = (int2)(axis, k);
            }
            side = build_union(side, bounds[axis][k]);
            above += counts[axis][k];
        }
    }
    return plane;
}

/* Moves the items of a range so that its two halves follow each other; returns where the second
 * begins. Where no plane divides, or the depth runs out, it is the middle: then the depth that is
 * left always suffices. */
inline uint build_cut(global float8 *items, Range r, float8 span, Half *left, Half *right)
{
    uint mid = r.first;
    uint levels = 32 - clz(r.count - 1); /* of a balanced tree */
    float4 extent = -span.hi - span.lo;
    if (r.depth + levels < BVH_DEPTH) {
        float4 scale = extent > 0.0f ? (build_bins(r.count) * 0.999999f) / extent : (float4)(0.0f);
        int2 plane = build_plane(items, r.first, r.count, span.lo, scale);
        if (plane.x >= 0) {
            uint end = r.first + r.count;
            *left = *right = build_empty();
            while (mid < end) {
                float8 item = items[mid];
                int4 bin = build_bin(item, span.lo, scale);
                int at = plane.x == 0 ? bin.x : plane.x == 1 ? bin.y : bin.z;
                if (at <= plane.y) {
                    *left = build_add(*left, item);
                    mid++;
                } else {
                    *right = build_add(*right, item);
                    end--;
                    items[mid] = items[end];
                    items[end] = item;
                }
            }
        }
    }
    if (mid == r.first || mid == r.first + r.count) {
        mid = r.first + r.count / 2;
        *left = *right = build_empty();
        for (uint i = r.first; i < mid; i++) *left = build_add(*left, items[i]);
        for (uint i = mid; i < r.first + r.count; i++) *right = build_add(*right, items[i]);
    }
    return mid;
}

/* Writes the node of a range; if it is to be divided, does so and returns 1. */
inline int build_range(const Build *b, Range r, Half h, Range children[2], Half halves[2])
{
    if (r.count <= b->leaf_size) {
        b->nodes[r.node] = build_node(h.bounds, b->reach, BVH_LEAF | r.first, r.count);
        return 0;
    }
    uint mid = build_cut(b->items, r, h.span, &halves[0], &halves[1]);
    b->nodes[r.node] = build_node(h.bounds, b->reach, 2 * mid, r.count);
    children[0] = (Range){2 * mid, r.first, mid - r.first, r.depth + 1};
    children[1] = (Range){2 * mid + 1, mid, r.first + r.count - mid, r.depth + 1};
    return 1;
}

/* --- kernels, in the order they run --- */

kernel APART void build_root(global const Half *restrict parts, uint n_parts, uint count,
                             global Range *restrict ranges, global Half *restrict halves)
{
    Half h = build_empty();
    for (uint i = 0; i < n_parts; i++) {
        h.bounds = build_union(h.bounds, parts[i].bounds);
        h.span = build_union(h.span, parts[i].span);
    }
    ranges[0] = (Range){0, 0, count, 0};
    halves[0] = h;
}

/* Ranges from `begin` on in the heap, a level of it. Those with no items are no ranges. */
kernel APART void build_level(global float8 *restrict items, global float8 *restrict nodes,
                              global Range *restrict ranges, global Half *restrict halves,
                              uint begin, uint leaf_size)
{
    uint k = begin + get_global_id(0);
    Build b = {items, nodes, build_reach(halves[0].bounds), leaf_size};
    Range r = ranges[k], children[2] = {{0, 0, 0, 0}, {0, 0, 0, 0}};
    Half sides[2];
    if (r.count && build_range(&b, r, halves[k], children, sides)) {
        halves[2 * k + 1] = sides[0];
        halves[2 * k + 2] = sides[1];
    }
    ranges[2 * k + 1] = children[0];
    ranges[2 * k + 2] = children[1];
}

kernel APART void build_subtree(global float8 *restrict items, global float8 *restrict nodes,
                                global const Range *restrict ranges,
                                global const Half *restrict halves, uint begin, uint leaf_size)
{
    Build b = {items, nodes, build_reach(halves[0].bounds), leaf_size};
    Range waiting[BVH_DEPTH];
    Half waiting_halves[BVH_DEPTH];
    int n = 0;
    Range r = ranges[begin + get_global_id(0)], children[2];
    Half h = halves[begin + get_global_id(0)], sides[2];
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
