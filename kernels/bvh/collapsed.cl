/* The wide nodes of a binary tree, by the choices of bvh/collapse.cl in `costs`. */
#include "bvh/node.cl"

/* The number of trees for the left child, of the trees below a node. */
inline uint collapse_share(global const float8 *costs, uint node, uint trees)
{
    return as_uint(((global const float *)(costs + node))[7]) >> 3 * (trees - 2) & 7u;
}

/* The binary nodes that become the children of the wide node at `root`; returns their number. The stack is at the
 * other end of `children`, with four bits for each entry's number of trees: NVIDIA's compiler of driver 580 gave two
 * dynamically indexed arrays the same memory. */
inline uint collapse_children(global const float8 *nodes, global const float8 *costs, uint root,
                              uint children[8])
{
    uint trees = 0, n = 0, found = 0, at = root, i = 8;
    for (;;) {
        uint share = 0;
        if (node_is_leaf(nodes[at])) i = 1;
        while (i > 1 && (share = collapse_share(costs, at, i)) == 0) i--;
        if (i > 1) {
            uint left = node_link(nodes[at]);
            children[7 - n++] = left + 1;
            trees = trees << 4 | (i - share);
            at = left;
            i = share;
        } else {
            children[found++] = at;
            if (!n) return found;
            at = children[7 - --n];
            i = trees & 15;
            trees >>= 4;
        }
    }
}
