/* Nodes of the binary tree: float8 of low corner, link, high corner, number of items below.
 *
 * The link of a leaf is its first item with BVH_LEAF set, that of an inner node its left child; the
 * right one follows it. The root is node 0. No leaf is more than BVH_DEPTH levels below the root.
 */
#define BVH_LEAF 0x80000000u
#define BVH_DEPTH 48

inline uint node_link(float8 node) { return as_uint(node.s3) & ~BVH_LEAF; }
inline int node_is_leaf(float8 node) { return as_uint(node.s3) >= BVH_LEAF; }
inline uint node_count(float8 node) { return as_uint(node.s7); }

inline float node_half_area(float8 node)
{
    float4 e = node.hi - node.lo;
    return e.x * e.y + e.y * e.z + e.z * e.x;
}
