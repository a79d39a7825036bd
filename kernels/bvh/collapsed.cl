/* What becomes of a binary tree made 8 wide, by the choices that bvh/collapse.cl left in `costs`. */
#include "bvh/node.cl"

/* Of so many trees below a node, how many the left child gets. */
inline uint collapse_share(global const float8 *costs, uint node, uint trees)
{
    return as_uint(((global const float *)(costs + node))[7]) >> 3 * (trees - 2) & 7u;
}

/* The binary nodes that become the children of the wide node at `root`; returns their number. What waits stands at the
 * other end of `children`, and how many trees it becomes in four bits each: NVIDIA's compiler of driver 580 gave two
 * arrays that are indexed at run time one place. */
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
