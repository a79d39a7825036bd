/* Nodes of the binary tree, and the items of a build.
 *
 * Nodes are float8: low corner, link, high corner, number of items below. The link of a leaf is its first item with
 * BVH_LEAF set; an inner node's link is its left child, and the right child follows. The root is node 0. No leaf is
 * more than BVH_DEPTH levels below the root.
 *
 * Items are boxes with a name: low corner, name, negated high corner, surface area of the content; so the union of two
 * boxes is a minimum. An item's name is its index with BVH_ITEM set, which keeps the bits away from denormals and NaN.
 */
#include "generated/tree_bits.cl"
#include "generated/tree_sizes.cl"
#define COMPACT_WORDS 20 /* of a node of bvh/compact.cl */

inline uint node_link(float8 node) { return as_uint(node.s3) & ~BVH_LEAF; }
inline int node_is_leaf(float8 node) { return as_uint(node.s3) >= BVH_LEAF; }
inline uint node_count(float8 node) { return as_uint(node.s7); }

/* Boxes of nodes are larger than their contents by an ulp or two, and by a tiny amount where a coordinate is 0: rays
 * inside a side's plane, with no direction across it, count as inside. bounds: low corner and negated high corner;
 * reach: the largest coordinate of the scene. Order is kept: a box inside another stays inside, and the union of
 * larger boxes is the larger union. */
inline float8 node_pad(float8 bounds, float reach) { return bounds - fabs(bounds) * 0x1p-22f - reach * 0x1p-40f; }

inline float8 node_make(float8 padded, uint link, uint count)
{
    float8 node = (float8)(padded.lo, -padded.hi);
    node.s3 = as_float(link);
    node.s7 = as_float(count);
    return node;
}

inline float node_half_area(float8 node) { float4 e = node.hi - node.lo; return e.x * e.y + e.y * e.z + e.z * e.x; }

#define BVH_ITEM 0x40000000u

/* Consecutive items, and their node. */
typedef struct { uint node, first, count, depth; } Range;

/* A range's bounds, and its span: the minimum of (centroid, -centroid). */
typedef struct { float8 bounds, span; } Extent;

inline float8 item_union(float8 a, float8 b) { return a < b ? a : b; }

/* Twice the centroid, and its negation; the fourth lanes are unused. */
inline float8 item_centroid(float8 item) { float4 c = item.lo - item.hi; return (float8)(c, -c); }

inline Extent extent_empty(void) { Extent h = {(float8)(INFINITY), (float8)(INFINITY)}; return h; }

inline Extent extent_add(Extent h, float8 item)
{
    h.bounds = item_union(h.bounds, item);
    h.span = item_union(h.span, item_centroid(item));
    return h;
}

inline float item_half_area(float8 bounds)
{
    float4 e = -bounds.hi - bounds.lo;
    return e.x * e.y + e.y * e.z + e.z * e.x;
}

inline float8 item_make(float4 lo, float4 hi, uint index, float area)
{
    lo.w = as_float(BVH_ITEM | index);
    hi.w = -area;
    return (float8)(lo, -hi);
}

inline uint item_index(float8 item) { return as_uint(item.s3) & ~BVH_ITEM; }
