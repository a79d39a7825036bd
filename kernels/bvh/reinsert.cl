/* Reinsertion: nodes are removed from a binary tree and inserted where the sum of all areas becomes least (Bittner,
 * Hapala and Havran 2013; search by Meister and Bittner 2018).
 *
 * Each pass searches the best position of every large node in parallel, in the unchanged tree. Then nodes move in
 * sequence: a former move may have made a position worse, so each gain is computed again, and only gainful moves are
 * done. So the tree does not depend on the number of parallel searches.
 *
 * Siblings are neighbours; `parents` has a word for each pair. A moved node keeps its memory with its pair, and the
 * pair's other half changes its node: no memory becomes free. The count of an inner node is the number of levels
 * below it, until bvh/collapse.cl replaces it.
 */
#include "bvh/node.cl"
#include "bvh/hints.cl"
#include "bvh/node.cl"

#define REINSERT_STACK (2 * BVH_DEPTH + 2)

inline uint reinsert_levels(float8 node) { return node_is_leaf(node) ? 0 : node_count(node); }

inline float8 reinsert_union(float8 a, float8 b)
{
    return (float8)(a.lo < b.lo ? a.lo : b.lo, a.hi > b.hi ? a.hi : b.hi);
}

/* A node around two children. */
inline float8 reinsert_node(global const float8 *nodes, uint link)
{
    float8 a = nodes[link], b = nodes[link + 1], node = reinsert_union(a, b);
    node.s3 = as_float(link);
    node.s7 = as_float(max(reinsert_levels(a), reinsert_levels(b)) + 1);
    return node;
}

/* The nodes below range k of the heap, from `x` up to `y`; the heap's last level begins with `begin`. */
inline uint2 reinsert_own(global const Range *ranges, global const uint *ends, uint begin, uint k)
{
    return k < begin ? (uint2)(0) : (uint2)(2 * (ranges[k].first + 1), ends[k - begin]);
}

/* The subtrees of build_subtree: parents, levels, the end of the nodes, and the sum and number of their areas. */
kernel NO_VECTORIZE void reinsert_subtree(global float8 *restrict nodes, global const Range *restrict ranges,
                                          uint begin, global uint *restrict parents, global uint *restrict ends,
                                          global float2 *restrict areas)
{
    uint k = get_global_id(0);
    Range r = ranges[begin + k];
    uint first = 2 * (r.first + 1), end = first;
    float2 sum = 0.0f;
    if (r.count) {
        uint at = r.node, next = first;
        do {
            float8 node = nodes[at];
            sum += (float2)(node_half_area(node), 1.0f);
            if (!node_is_leaf(node)) {
                parents[node_link(node) / 2] = at;
                end += 2; /* children follow their parents */
            }
            at = next++;
        } while (at < end);
        for (at = end; at >= first; at--) { /* the range's node last */
            uint below = at > first ? at - 1 : r.node;
            if (!node_is_leaf(nodes[below])) nodes[below] = reinsert_node(nodes, node_link(nodes[below]));
        }
    }
    ends[k] = end;
    areas[k] = sum;
}

/* The ranges above, and in areas[0] the mean of all areas. */
kernel NO_VECTORIZE void reinsert_top(global float8 *restrict nodes, global const Range *restrict ranges, uint begin,
                                      global uint *restrict parents, global float2 *restrict areas)
{
    float2 sum = 0.0f;
    for (uint k = 0; k <= begin; k++) sum += areas[k];
    areas[0].x = sum.x / max(sum.y, 1.0f);
    for (uint k = begin; k-- > 0;) {
        uint at = ranges[k].node;
        if (!ranges[k].count || node_is_leaf(nodes[at])) continue;
        nodes[at] = reinsert_node(nodes, node_link(nodes[at]));
        parents[node_link(nodes[at]) / 2] = at;
    }
}

/* The best new sibling of a node; 0 to leave it. */
inline uint reinsert_search(global const float8 *nodes, global const uint *parents, uint x)
{
    uint waiting[REINSERT_STACK], parent = parents[x / 2], target = 0;
    if (!parent) return 0;
    float gains[REINSERT_STACK], best = 0.0f;
    float8 node = nodes[x], without = nodes[x ^ 1];
    float area = node_half_area(node), gain = node_half_area(nodes[parent]);
    for (uint below = x; below;) { /* up to the root, at each step into the sibling */
        uint n = 1;
        waiting[0] = below ^ 1;
        gains[0] = gain;
        while (n) {
            float g = gains[--n];
            if (g - area <= best) continue;
            uint at = waiting[n];
            float8 place = nodes[at];
            g -= node_half_area(reinsert_union(place, node));
            if (g > best) {
                best = g;
                target = at;
            }
            g += node_half_area(place);
            if (node_is_leaf(place) || g - area <= best) continue;
            waiting[n] = node_link(place);
            waiting[n + 1] = node_link(place) + 1;
            gains[n] = gains[n + 1] = g;
            n += 2;
        }
        without = reinsert_union(without, nodes[below ^ 1]);
        below = parents[below / 2];
        if (below != parent) gain += node_half_area(nodes[below]) - node_half_area(without);
    }
    return target;
}

/* The best new siblings of nodes larger than the mean, for each range of the heap. */
kernel NO_VECTORIZE void reinsert_find(global const float8 *restrict nodes, global const Range *restrict ranges,
                                       uint begin, global const uint *restrict parents,
                                       global const uint *restrict ends, global const float2 *restrict areas,
                                       global uint *restrict targets)
{
    uint k = get_global_id(0), at = ranges[k].node;
    uint2 own = reinsert_own(ranges, ends, begin, k);
    float least = areas[0].x;
    if (ranges[k].count) targets[at] = at ? reinsert_search(nodes, parents, at) : 0;
    for (at = own.x; at < own.y; at++)
        targets[at] = node_half_area(nodes[at]) > least ? reinsert_search(nodes, parents, at) : 0;
}

/* Updates boxes and levels from a node up to the first unchanged node; returns the decrease of areas. */
inline float reinsert_refit(global float8 *nodes, global const uint *parents, uint at)
{
    float lost = 0.0f;
    for (;;) {
        float8 node = nodes[at], anew = reinsert_node(nodes, node_link(node));
        if (all(as_int8(node) == as_int8(anew))) return lost;
        lost += node_half_area(node) - node_half_area(anew);
        nodes[at] = anew;
        if (!at) return lost;
        at = parents[at / 2];
    }
}

inline void reinsert_put(global float8 *nodes, global uint *parents, uint at, float8 node)
{
    nodes[at] = node;
    if (!node_is_leaf(node)) parents[node_link(node) / 2] = at;
}

/* The change of areas if a node became the sibling of node `at`; INFINITY if it cannot. */
inline float reinsert_growth(global const float8 *nodes, global const uint *parents, uint x, uint at)
{
    float8 node = nodes[x];
    float growth = node_half_area(reinsert_union(nodes[at], node));
    uint depth = max(reinsert_levels(nodes[at]), reinsert_levels(node)) + 1;
    for (; at; depth++) {
        if (at == x) return INFINITY;
        at = parents[at / 2];
        growth += node_half_area(reinsert_union(nodes[at], node)) - node_half_area(nodes[at]);
    }
    return depth > BVH_DEPTH ? INFINITY : growth;
}

/* Makes a node the sibling of `target`, if areas decrease. */
inline void reinsert_move(global float8 *nodes, global uint *parents, uint x, uint target)
{
    uint pair = x & ~1u, parent = parents[pair / 2];
    if (!parent || target == x || target == (x ^ 1) || target == parent) return;
    float gain = node_half_area(nodes[parent]);
    reinsert_put(nodes, parents, parent, nodes[x ^ 1]);
    gain += reinsert_refit(nodes, parents, parents[parent / 2]);
    if (!(reinsert_growth(nodes, parents, x, target) < gain)) target = parent; /* back */
    reinsert_put(nodes, parents, x ^ 1, nodes[target]);
    reinsert_put(nodes, parents, target, reinsert_node(nodes, pair));
    reinsert_refit(nodes, parents, parents[target / 2]);
}

/* Moves the nodes to their new siblings. */
kernel NO_VECTORIZE void reinsert_all(global float8 *restrict nodes, global const Range *restrict ranges,
                                      uint begin, global uint *restrict parents, global const uint *restrict ends,
                                      global const uint *restrict targets)
{
    for (uint k = 0; k < 2 * begin + 1; k++) {
        if (!ranges[k].count) continue;
        uint at = ranges[k].node;
        if (targets[at]) reinsert_move(nodes, parents, at, targets[at]);
        uint2 own = reinsert_own(ranges, ends, begin, k);
        for (at = own.x; at < own.y; at++)
            if (targets[at]) reinsert_move(nodes, parents, at, targets[at]);
    }
}

/* The members of the heap of ranges that bvh/collapse.cl reads, for the changed tree. */
kernel NO_VECTORIZE void reinsert_ranges(global const float8 *restrict nodes, global Range *restrict ranges,
                                         uint begin)
{
    for (uint k = 0; k < begin; k++) {
        float8 node = nodes[ranges[k].node];
        uint inner = ranges[k].count && !node_is_leaf(node), link = inner ? node_link(node) : 0;
        ranges[2 * k + 1] = (Range){link, 0, inner, 0};
        ranges[2 * k + 2] = (Range){link + inner, 0, inner, 0};
    }
}
