/* A binary tree made 8 wide with the least SAH cost, by dynamic programming (Ylitie 2017, sec. 3).
 *
 * costs[node]: lanes 0 to 6 are C(node, i), the least cost of at most i = 1 .. 7 wide trees that
 * together hold the node's subtree; lane 7 keeps the choices as bits: for i = 2 .. 8 the number of trees
 * for the left child (0: as for i - 1). A leaf of the binary tree, with at most 8 triangles, is a block;
 * the cost of a block does not depend on their number.
 *
 * Wide nodes are 8 rows of float8: low x, high x, low y, high y, low z, high z of the children,
 * their words, and their binary nodes plus 1, or 0 without a child; a child's word is its wide node, or its
 * block with BVH_LEAF set.
 */
#include "bvh/hints.cl"
#include "bvh/node.cl"

#define COLLAPSE_EVENLY (4 << 18 | 3 << 15 | 3 << 12 | 2 << 9 | 2 << 6 | 1 << 3 | 1) /* choices: half to each child */

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

/* Step. */
#include "bvh/hints.cl"
#include "bvh/leaves.cl"

#define COLLAPSE_AHEAD 4 /* blocks */
#define COLLAPSE_NODE_COST 1.0f
#define COLLAPSE_BLOCK_COST 1.0f

/* The probability that a random line through the node's box hits a triangle in it: half of a triangle's area over a
 * quarter of the box's surface (Cauchy), as if triangles were independent. */
inline float collapse_leaf_occlusion(global const float8 *items, float8 node)
{
    float through = 1.0f, half_area = node_half_area(node);
    for (uint i = node_link(node); i < node_link(node) + node_count(node); i++)
        through *= 1.0f - min(items[i].s7 / (2.0f * half_area), 1.0f);
    return half_area > 0.0f ? 1.0f - through : 0.0f;
}

/* Costs of a node after its children. With at most leaf_size items it is a block. Its count becomes the children's sum:
 * a tree over runs has counted runs. */
inline void collapse_node(global float8 *nodes, global const float8 *items, global float8 *costs,
                          global float *occlusion, uint at, uint leaf_size)
{
    float8 node = nodes[at];
    float area = node_half_area(node), block = area * COLLAPSE_BLOCK_COST;
    if (node_is_leaf(node)) {
        costs[at] = (float8)(block);
        occlusion[at] = collapse_leaf_occlusion(items, node);
        return;
    }
    uint left = node_link(node), right = left + 1, choices = 0;
    ((global uint *)(nodes + at))[7] = node_count(nodes[left]) + node_count(nodes[right]);
    union { float8 v; float at[8]; } l, r, c;
    l.v = costs[left];
    r.v = costs[right];
    float least = INFINITY;
    for (uint trees = 8; trees >= 2; trees--) {
        least = INFINITY;
        uint share = 1;
        for (uint k = 1; k < trees; k++) {
            float cost = l.at[k - 1] + r.at[trees - k - 1];
            share = cost < least ? k : share;
            least = min(cost, least);
        }
        c.at[trees - 1] = least;
        choices |= share << 3 * (trees - 2);
    }
    c.at[0] = node_count(node) <= leaf_size ? block : c.at[7] + area * COLLAPSE_NODE_COST;
    for (uint trees = 2; trees <= 7; trees++)
        if (c.at[trees - 2] <= c.at[trees - 1]) {
            c.at[trees - 1] = c.at[trees - 2];
            choices &= ~(7u << 3 * (trees - 2));
        }
    c.at[7] = as_float(choices);
    costs[at] = c.v;
    float pl = occlusion[left] * node_half_area(nodes[left]);
    float pr = occlusion[right] * node_half_area(nodes[right]);
    occlusion[at] = area > 0.0f ? 1.0f - (1.0f - pl / area) * (1.0f - pr / area) : 0.0f;
}

/* Costs of the subtrees of build_subtree, children before parents. */
kernel NO_VECTORIZE void collapse_subtree(global float8 *restrict nodes,
                                          global const float8 *restrict items,
                                          global const Range *restrict ranges, uint begin,
                                          global float8 *restrict costs, global float *restrict occlusion)
{
    Range r = ranges[begin + get_global_id(0)];
    uint waiting[2 * BVH_DEPTH + 2]; /* node; BVH_LEAF is set after its children were pushed */
    int n = 0;
    if (r.count) waiting[n++] = r.node;
    while (n) {
        uint at = waiting[n - 1];
        float8 node = nodes[at & ~BVH_LEAF];
        if (at & BVH_LEAF || node_is_leaf(node)) {
            collapse_node(nodes, items, costs, occlusion, at & ~BVH_LEAF, 0);
            n--;
        } else {
            waiting[n - 1] |= BVH_LEAF;
            waiting[n++] = node_link(node) + 1;
            waiting[n++] = node_link(node);
        }
    }
}

/* Costs of a level of the heap of ranges, after the levels below. */
kernel NO_VECTORIZE void collapse_level(global float8 *restrict nodes,
                                        global const float8 *restrict items,
                                        global const Range *restrict ranges, uint begin,
                                        global float8 *restrict costs, global float *restrict occlusion)
{
    Range r = ranges[begin + get_global_id(0)];
    if (r.count) collapse_node(nodes, items, costs, occlusion, r.node, 0);
}

/* Costs of nodes of bvh/clusters.cl, from `begin` on, after the rounds before. */
kernel NO_VECTORIZE void collapse_pairs(global float8 *restrict nodes, global const float8 *restrict items,
                                        uint begin, uint count, uint leaf_size, global float8 *restrict costs,
                                        global float *restrict occlusion)
{
    if (get_global_id(0) < count) collapse_node(nodes, items, costs, occlusion, begin + get_global_id(0), leaf_size);
}

/* Numbers the wide nodes and blocks, level by level: a node's child nodes, and its blocks, have
 * neighbouring numbers. See collapse_number. */
inline void collapse_levels(global const float8 *nodes, global const float8 *costs, global uint *roots,
                            global uint2 *firsts, global uint *leaf_roots, global uint *totals)
{
    uint children[8], n_nodes = 1, n_blocks = 0, levels = 0, below = 0;
    roots[0] = 0;
    for (uint at = 0; at < n_nodes; at++) {
        if (at == below) {
            totals[4 + levels++] = at;
            below = n_nodes;
        }
        uint found = collapse_children(nodes, costs, roots[at], children);
        firsts[at] = (uint2)(n_nodes, n_blocks);
        for (uint i = 0; i < found; i++) {
            if (node_is_leaf(nodes[children[i]]))
                leaf_roots[n_blocks++] = children[i];
            else
                roots[n_nodes++] = children[i];
        }
    }
    totals[0] = n_nodes;
    totals[1] = n_blocks;
    totals[2] = levels;
}

/* roots, leaf_roots: the binary node of each wide node and block; firsts: a node's first child node and first
 * block. totals: nodes, blocks, levels, as a float the tree's cost for a line that meets its box, and the first
 * node of each level. If the tree of least cost has more levels than the stacks of traversals, every node takes
 * its descendants three levels below as children instead. count: of `costs`. */
kernel NO_VECTORIZE void collapse_number(global const float8 *restrict nodes, global float8 *restrict costs,
                                         uint count, global uint *restrict roots,
                                         global uint2 *restrict firsts, global uint *restrict leaf_roots,
                                         global uint *restrict totals)
{
    float area = node_half_area(nodes[0]);
    collapse_levels(nodes, costs, roots, firsts, leaf_roots, totals);
    if (totals[2] > BVH_LEVELS) {
        for (uint i = 0; i < count; i++) ((global uint *)(costs + i))[7] = COLLAPSE_EVENLY;
        collapse_levels(nodes, costs, roots, firsts, leaf_roots, totals);
    }
    totals[3] = as_uint(area > 0.0f ? ((global const float *)costs)[0] / area : 0.0f);
}

/* A shadow ray's priority of a child: the probability of a hit over the cost. */
inline float collapse_promise(global const float8 *nodes, global const float8 *costs,
                              global const float *occlusion, uint node)
{
    float cost = ((global const float *)(costs + node))[0];
    return cost > 0.0f ? occlusion[node] * node_half_area(nodes[node]) / cost : 0.0f;
}

/* Writes a wide node if `count` has room for all nodes in `totals`. Children have ascending priority, for traversals
 * visit the last slot first. Empty slots hold a box that no ray hits, and link to block 0. */
kernel NO_VECTORIZE void collapse_nodes(global const float8 *restrict nodes,
                                        global const float8 *restrict costs,
                                        global const float *restrict occlusion,
                                        global const uint *restrict roots,
                                        global const uint2 *restrict firsts,
                                        global const uint *restrict totals, uint count,
                                        global float *restrict wide)
{
    uint w = get_global_id(0);
    if (w >= totals[0] || totals[0] > count) return;
    uint children[8], words[8];
    float promise[8];
    uint found = collapse_children(nodes, costs, roots[w], children);
    uint2 next = firsts[w];
    for (uint i = 0; i < found; i++) {
        uint child = children[i];
        uint word = node_is_leaf(nodes[child]) ? BVH_LEAF | next.y++ : next.x++;
        float p = collapse_promise(nodes, costs, occlusion, child);
        uint k = i;
        for (; k > 0 && promise[k - 1] > p; k--) {
            promise[k] = promise[k - 1];
            children[k] = children[k - 1];
            words[k] = words[k - 1];
        }
        promise[k] = p;
        children[k] = child;
        words[k] = word;
    }
    global float *row = wide + (ulong)w * 64;
    for (uint k = 0; k < 8; k++, row++) {
        float8 node = (float8)((float4)(FLT_MAX), (float4)(-FLT_MAX));
        if (k < found) node = nodes[children[k]];
        row[0] = node.s0;
        row[8] = node.s4;
        row[16] = node.s1;
        row[24] = node.s5;
        row[32] = node.s2;
        row[40] = node.s6;
        row[48] = as_float(k < found ? words[k] : BVH_LEAF);
        row[56] = as_float(k < found ? children[k] + 1 : 0);
    }
}

/* Prefetches the faces of a leaf's triangles, which lie anywhere. */
inline void collapse_fetch(global const float8 *nodes, global const float8 *items, global const uint *faces,
                           uint leaf)
{
    uint first = node_link(nodes[leaf]), n = node_count(nodes[leaf]);
    for (uint k = 0; k < n; k++) FETCH(faces + 3 * (ulong)item_index(items[first + k]));
}

/* Writes a block. */
kernel NO_VECTORIZE void collapse_blocks(global const float8 *restrict nodes,
                                         global const float8 *restrict items,
                                         global const uint *restrict leaf_roots, uint count,
                                         global const float *restrict vertices,
                                         global const uint *restrict faces,
                                         global const uint *restrict tags, global float *restrict blocks)
{
    uint b = get_global_id(0);
    if (b >= count) return;
    collapse_fetch(nodes, items, faces, leaf_roots[min(b + COLLAPSE_AHEAD, count - 1)]);
    float8 node = nodes[leaf_roots[b]];
    uint first = node_link(node), n = node_count(node);
    global float *block = blocks + (ulong)b * 88;
    global uint *words = (global uint *)block + 72;
    for (uint k = 0; k < 8; k++) {
        uint prim = item_index(items[first + min(k, n - 1)]), there = -(uint)(k < n);
        words[k] = prim | ~there; /* BVH_MISS */
        words[8 + k] = tags[prim] & there;
    }
    leaf_store_block(block, vertices, faces);
}

/* Writes the items' indices in the order of the wide tree's leaves, for leaves with a single item. Binary leaves get
 * the same numbers. */
kernel NO_VECTORIZE void collapse_indices(global float8 *restrict nodes,
                                          global const float8 *restrict items,
                                          global const uint *restrict leaf_roots, uint count,
                                          global uint *restrict indices)
{
    uint b = get_global_id(0);
    if (b >= count) return;
    global float8 *leaf = nodes + leaf_roots[b];
    indices[b] = item_index(items[node_link(*leaf)]);
    ((global uint *)leaf)[3] = BVH_LEAF | b;
}

/* Step levels: the numbers of collapse_number, a level a launch. */
#include "bvh/scan.cl"

inline int collapse_is_leaf(float8 node, uint leaf_size)
{
    return node_is_leaf(node) || node_count(node) <= leaf_size;
}

/* The child nodes in x, and the leaves in y, of a share of wide nodes. */
inline uint2 collapse_tally(global const float8 *nodes, global const float8 *costs, global const uint *roots,
                            uint2 share, uint leaf_size)
{
    uint2 sum = (uint2)(0);
    for (uint w = share.x; w < share.y; w++) {
        uint children[8], n = collapse_children(nodes, costs, roots[w], children), leaves = 0;
        for (uint i = 0; i < n; i++) leaves += collapse_is_leaf(nodes[children[i]], leaf_size);
        sum += (uint2)(n - leaves, leaves);
    }
    return sum;
}

/* Counts the children of a level's nodes, tile by tile. */
kernel NO_VECTORIZE void collapse_count(global const float8 *restrict nodes, global const float8 *restrict costs,
                                        global const uint *restrict roots, uint begin, uint end, uint leaf_size,
                                        uint tile, uint tiles, global uint *restrict numbers, local uint2 *sums)
{
    uint2 share = scan_tile(tile, end - begin) + (uint2)(begin);
    uint2 sum = collapse_tally(nodes, costs, roots, share, leaf_size), all = scan_group(sums, &sum);
    if (get_local_id(0) == 0 && get_group_id(0) < tiles) {
        numbers[get_group_id(0)] = all.x;
        numbers[tiles + get_group_id(0)] = all.y;
    }
}

/* Numbers the children of a level's nodes from `first` on, nodes in x and leaves in y. Binary nodes with at most
 * leaf_size items become leaves; positions: their first items. */
kernel NO_VECTORIZE void collapse_place(global float8 *restrict nodes, global const float8 *restrict costs,
                                        global uint *restrict roots, uint begin, uint end, uint leaf_size,
                                        uint tile, uint tiles, global const uint *restrict numbers, uint2 first,
                                        global const uint *restrict positions, global uint2 *restrict firsts,
                                        global uint *restrict leaf_roots, local uint2 *sums)
{
    uint2 share = scan_tile(tile, end - begin) + (uint2)(begin);
    uint2 next = collapse_tally(nodes, costs, roots, share, leaf_size);
    scan_group(sums, &next);
    if (get_group_id(0) >= tiles) return;
    next += first + (uint2)(numbers[get_group_id(0)], numbers[tiles + get_group_id(0)] - numbers[tiles]);
    for (uint w = share.x; w < share.y; w++) {
        uint children[8], n = collapse_children(nodes, costs, roots[w], children);
        firsts[w] = next;
        for (uint i = 0; i < n; i++) {
            uint child = children[i];
            if (collapse_is_leaf(nodes[child], leaf_size)) {
                leaf_roots[next.y++] = child;
                if (!node_is_leaf(nodes[child])) nodes[child].s3 = as_float(positions[child] | BVH_LEAF);
            } else {
                roots[next.x++] = child;
            }
        }
    }
}

/* Lets every node take its descendants three levels below as children. */
kernel NO_VECTORIZE void collapse_evenly(global float8 *restrict costs, uint count)
{
    if (get_global_id(0) < count) ((global uint *)(costs + get_global_id(0)))[7] = COLLAPSE_EVENLY;
}

/* Step compact: compressed nodes (bvh/compact.cl) from the collapse of a binary tree, without boxes and corners of
 * triangles, which bvh/refit.cl computes next.
 *
 * Siblings are reordered by their slots. So `places` keeps every node's number in the collapse, and the first item of
 * its subtree: a node's items come first, then each child's in turn. */

/* Slots for the children, four bits each, 8 beyond `found`. The pair of child and slot with the largest offset along
 * the slot's diagonal is assigned first. */
inline uint compact_child_slots(global const float8 *nodes, float8 parent, const uint *children, uint found)
{
    float4 middle = parent.lo + parent.hi;
    uint slots = 0x88888888u, taken = 0;
    for (uint round = 0; round < found; round++) {
        uint child = 0, slot = 0;
        float farthest = -INFINITY;
        for (uint i = 0; i < found; i++) {
            if ((slots >> 4 * i & 15) < 8) continue;
            float8 box = nodes[children[i]];
            float4 offset = box.lo + box.hi - middle;
            for (uint s = 0; s < 8; s++) {
                float far = (s & 1 ? offset.x : -offset.x) + (s & 2 ? offset.y : -offset.y) +
                            (s & 4 ? offset.z : -offset.z);
                if (!(taken >> s & 1) && far > farthest) {
                    farthest = far;
                    child = i;
                    slot = s;
                }
            }
        }
        slots ^= (8 ^ slot) << 4 * child;
        taken |= 1u << slot;
    }
    return slots;
}

/* A level of nodes, from `begin` on, after the levels above. leaves: records of triangles, which get tags and the
 * caller's numbers, or only numbers if `tags` is null. */
kernel NO_VECTORIZE void compact_nodes(global const float8 *restrict nodes, global const float8 *restrict items,
                                       global const float8 *restrict costs, global const uint *restrict roots,
                                       global const uint2 *restrict firsts, uint begin, uint count,
                                       global uint2 *restrict places, global uint *restrict compact,
                                       global uint *restrict leaves, global const uint *restrict tags)
{
    if (get_global_id(0) >= count) return;
    uint w = begin + get_global_id(0), children[8]; /* no second array: see collapse_children */
    uint2 place = w ? places[w] : (uint2)(0);
    uint found = collapse_children(nodes, costs, roots[place.x], children), mask = 0, inner = 0;
    uint slots = compact_child_slots(nodes, nodes[roots[place.x]], children, found);
    global uint *node = compact + (ulong)w * COMPACT_WORDS;
    uint base = firsts[place.x].x, own = 0;
    ulong meta = 0;
    for (uint i = 0; i < found; i++) {
        float8 child = nodes[children[i]];
        uint slot = slots >> 4 * i & 15;
        if (node_is_leaf(child)) {
            meta |= (ulong)(own | (0xe0u >> (3 - node_count(child)) & 0xe0u)) << 8 * slot;
            for (uint k = 0; k < node_count(child); k++, own++) {
                uint at = place.y + own, prim = item_index(items[node_link(child) + k]);
                if (tags) {
                    vstore3((uint3)(prim, tags[prim], 0u), 0, leaves + (ulong)at * 12 + 9);
                } else {
                    leaves[at] = prim;
                }
            }
        } else {
            meta |= (ulong)(0x20u | (24 + slot)) << 8 * slot;
            mask |= 1u << slot;
            inner |= 1u << i;
        }
    }
    node[3] = mask << 24;
    node[4] = base;
    node[5] = place.y;
    node[6] = (uint)meta;
    node[7] = (uint)(meta >> 32);
    uint item = place.y + own, position = base;
    for (uint slot = 0; slot < 8; slot++) {
        if (!(mask >> slot & 1)) continue;
        uint i = 0;
        while ((slots >> 4 * i & 15) != slot) i++;
        places[position++] = (uint2)(base + popcount(inner & ((1u << i) - 1)), item);
        item += node_count(nodes[children[i]]);
    }
}
