/* Nodes of the binary tree: float8 of low corner, link, high corner, number of items below.
 *
 * The link of a leaf is its first item with BVH_LEAF set; an inner node's link is its left child, and the right
 * child follows. The root is node 0. No leaf is more than BVH_DEPTH levels below the root.
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
