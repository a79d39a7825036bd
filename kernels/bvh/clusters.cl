/* A binary tree from the leaves up, by parallel locally-ordered clustering (Meister and Bittner 2018; Benthin et al.
 * 2022): clusters lie in the order of a space-filling curve, and two neighbours unite if each is the other's nearest.
 *
 * Clusters are nodes of bvh/node.cl, with their height, the levels below, in the six highest bits of the number of
 * items. levels[k].x is the number of clusters before round k, and levels[k].y the largest height. Each union takes a
 * cluster away: the unions of round k are pairs levels[k + 1].x to levels[k].x - 1 of nodes, and the root is node 0.
 * counts[pair] is the number of items of the pair's parent. No position depends on the order of work-items, so two
 * builds give the same tree.
 */
#include "bvh/hints.cl"
#include "bvh/node.cl"
#include "bvh/scan.cl"
#include "generated/curve_keys.cl"

#define CLUSTERS_ROUNDS 128 /* at most */
#define CLUSTERS_MANY ((1u << 26) - 1) /* items, or more */
#define CLUSTERS_SLACK 8u /* levels beyond 3 / 2 of the logarithm of the items */

inline float8 clusters_unite(float8 a, float8 b) { return (float8)(fmin(a.lo, b.lo), fmax(a.hi, b.hi)); }

inline uint clusters_size(global const uint *counts, float8 cluster)
{
    return node_is_leaf(cluster) ? 1 : counts[node_link(cluster) / 2];
}

inline uint clusters_height(float8 cluster) { return node_count(cluster) >> 26; }

/* Whether two clusters may unite. The boxes of a fan of triangles lie in each other, and each is nearest to the next
 * smaller: all would make one chain. */
inline int clusters_fit(float8 a, float8 b)
{
    uint size = (node_count(a) & CLUSTERS_MANY) + (node_count(b) & CLUSTERS_MANY);
    return max(clusters_height(a), clusters_height(b)) < CLUSTERS_SLACK + 3 * (31 - clz(size)) / 2;
}

/* Clusters of an item each, in the order of sorted keys; extents: of the scene. */
kernel NO_VECTORIZE void clusters_begin(global const float8 *restrict items, global const ulong *restrict keys,
                                        uint count, global const Extent *restrict extents,
                                        global float8 *restrict clusters, global float8 *restrict nodes,
                                        global uint2 *restrict levels)
{
    uint i = get_global_id(0);
    if (i >= count) return;
    uint index = keys[i] & (1ul << CURVE_INDEX) - 1;
    float8 scene = extents[0].bounds;
    float4 reach = fmax(fabs(scene.lo), fabs(scene.hi));
    float8 padded = node_pad(items[index], fmax(reach.x, fmax(reach.y, reach.z)));
    clusters[i] = node_make(padded, BVH_LEAF | index, 1);
    if (i == 0) levels[0].x = count;
    if (count == 1) nodes[0] = clusters[0];
}

/* The radius of a round: 0, for pairs of places, where levels or rounds run out, or no clusters fit any more. */
inline uint clusters_radius(global const uint2 *levels, uint round, uint radius)
{
    uint2 level = levels[round];
    uint left = 32 - clz(level.x - 1); /* levels, if pairs unite from now on */
    if (round && levels[round - 1].x == level.x) return 0;
    return level.y + 1 + left > BVH_DEPTH || round + 1 + left > CLUSTERS_ROUNDS ? 0 : radius;
}

/* Cluster i's nearest neighbour of n, at most `radius` places away, itself without one: with the least area of both. Of
 * equally near ones it is the neighbour of the same pair of places, else the fewest places away, else before it. So the
 * least pair of all is each other's nearest, and equal clusters all find a partner. */
inline uint clusters_nearest(global const float8 *clusters, uint i, uint n, uint radius)
{
    uint partner = min(i ^ 1, n - 1), best = i;
    if (!radius) return partner;
    float8 cluster = clusters[i];
    float least = INFINITY;
    for (int k = -1; k < 2 * (int)radius; k++) {
        uint j = k < 0 ? partner : k & 1 ? i + k / 2 + 1 : i - k / 2 - 1; /* wraps below 0 */
        if (j >= n || j == i) continue;
        float8 other = clusters[j];
        float area = clusters_fit(cluster, other) ? node_half_area(clusters_unite(cluster, other)) : INFINITY;
        best = area < least ? j : best;
        least = min(area, least);
    }
    return best;
}

kernel NO_VECTORIZE void clusters_find(global const float8 *restrict clusters, uint count, uint round,
                                       global const uint2 *restrict levels, uint radius,
                                       global uint *restrict nearest)
{
    uint n = levels[round].x, i = get_global_id(0);
    if (i < n && n > 1) nearest[i] = clusters_nearest(clusters, i, n, clusters_radius(levels, round, radius));
}

/* Whether a cluster unites: x with a later, y with an earlier one. */
inline uint2 clusters_role(global const uint *nearest, uint i)
{
    uint j = nearest[i];
    uint both = nearest[j] == i;
    return (uint2)(both && i < j, both && j < i);
}

inline uint2 clusters_roles(global const uint *nearest, uint2 share)
{
    uint2 roles = (uint2)(0);
    for (uint i = share.x; i < share.y; i++) roles += clusters_role(nearest, i);
    return roles;
}

/* Counts both roles in a tile. */
kernel NO_VECTORIZE void clusters_count(global const uint *restrict nearest, uint tile, uint tiles, uint round,
                                        global const uint2 *restrict levels, global uint *restrict numbers,
                                        local uint2 *sums)
{
    uint n = levels[round].x;
    uint2 roles = clusters_roles(nearest, scan_tile(tile, n > 1 ? n : 0));
    uint2 all = scan_group(sums, &roles);
    if (get_local_id(0) == 0 && get_group_id(0) < tiles) {
        numbers[get_group_id(0)] = all.x;
        numbers[tiles + get_group_id(0)] = all.y;
    }
}

/* The union of two clusters, which become a pair of nodes. */
inline float8 clusters_pair(float8 a, float8 b, uint pair, global float8 *nodes, global uint *counts)
{
    uint below_a = clusters_size(counts, a), below_b = clusters_size(counts, b);
    uint height = 1 + max(clusters_height(a), clusters_height(b)), below = below_a + below_b;
    float8 both = clusters_unite(a, b);
    both.s3 = as_float(2 * pair);
    both.s7 = as_float(height << 26 | min(below, CLUSTERS_MANY));
    a.s7 = as_float(below_a);
    b.s7 = as_float(below_b);
    nodes[2 * pair] = a;
    nodes[2 * pair + 1] = b;
    counts[pair] = below;
    return both;
}

/* Unites a share of n clusters, and moves all up; roles: counted before the share; unions: in the round. Returns the
 * height of the highest union. */
inline uint clusters_unify(global const float8 *clusters, global const uint *nearest, uint2 share, uint n,
                           uint2 roles, uint unions, global float8 *next, global float8 *nodes,
                           global uint *counts)
{
    uint highest = 0;
    for (uint i = share.x; i < share.y; i++) {
        uint2 role = clusters_role(nearest, i);
        float8 cluster = clusters[i];
        if (role.x) {
            cluster = clusters_pair(cluster, clusters[nearest[i]], n - 1 - roles.x, nodes, counts);
            highest = max(highest, clusters_height(cluster));
            if (n - unions == 1) {
                nodes[0] = cluster;
                nodes[0].s7 = as_float(counts[n - 1 - roles.x]);
            }
        }
        if (!role.y) next[i - roles.y] = cluster;
        roles += role;
    }
    return highest;
}

/* Writes the next level: a call of one work-item tells its size, each its height. */
inline void clusters_level(global uint2 *level, uint n, uint highest)
{
    if (n) level->x = n;
    atomic_max((volatile global uint *)level + 1, highest);
}

kernel NO_VECTORIZE void clusters_round(global const float8 *restrict clusters, global const uint *restrict nearest,
                                        uint tile, uint tiles, uint round, global uint2 *restrict levels,
                                        global const uint *restrict numbers, global float8 *restrict next,
                                        global float8 *restrict nodes, global uint *restrict counts,
                                        local uint2 *sums)
{
    uint2 level = levels[round];
    uint unions = numbers[tiles], group = min((uint)get_group_id(0), tiles - 1);
    uint2 share = scan_tile(tile, level.x > 1 ? level.x : 0), roles = clusters_roles(nearest, share);
    scan_group(sums, &roles);
    roles += (uint2)(numbers[group], numbers[tiles + group] - unions);
    uint highest = clusters_unify(clusters, nearest, share, level.x, roles, unions, next, nodes, counts);
    clusters_level(levels + round + 1, get_global_id(0) ? 0 : level.x - unions, max(highest, level.y));
}

/* All rounds that are left, in a single group. */
kernel NO_VECTORIZE void clusters_finish(global float8 *clusters, global float8 *next, global uint *nearest,
                                         uint round, uint radius, global uint2 *levels, global float8 *nodes,
                                         global uint *counts, local uint2 *sums)
{
    uint2 level = levels[round];
    for (; level.x > 1; round++) {
        uint2 share = scan_share(level.x);
        for (uint i = share.x; i < share.y; i++)
            nearest[i] = clusters_nearest(clusters, i, level.x, clusters_radius(levels, round, radius));
        barrier(CLK_GLOBAL_MEM_FENCE);
        uint2 roles = clusters_roles(nearest, share);
        uint unions = scan_group(sums, &roles).x;
        uint highest = clusters_unify(clusters, nearest, share, level.x, roles, unions, next, nodes, counts);
        clusters_level(levels + round + 1, get_local_id(0) ? 0 : level.x - unions, max(highest, level.y));
        barrier(CLK_GLOBAL_MEM_FENCE);
        level = levels[round + 1];
        global float8 *former = clusters;
        clusters = next;
        next = former;
    }
}

/* The order of leaves, from the root down: positions are of a node's first item. A node with at most leaf_size items
 * becomes a leaf, and nodes below it, whose positions have BVH_LEAF set, become empty. */
kernel NO_VECTORIZE void clusters_order(global const float8 *restrict items, uint begin, uint count,
                                        uint leaf_size, global uint *restrict positions,
                                        global float8 *restrict nodes, global float8 *restrict ordered)
{
    if (get_global_id(0) >= count) return;
    uint at = begin + get_global_id(0), position = at ? positions[at] : 0, unused = position & BVH_LEAF;
    float8 node = nodes[at];
    uint link = node_link(node), leaf = node_count(node) <= leaf_size ? BVH_LEAF : 0;
    if (!at) positions[0] = 0;
    if (node_is_leaf(node)) {
        ordered[position ^ unused] = items[link];
    } else {
        positions[link] = position | leaf;
        positions[link + 1] = (position + node_count(nodes[link])) | leaf;
    }
    if (!leaf) return;
    nodes[at].s3 = as_float(position | BVH_LEAF);
    if (unused) nodes[at].s7 = as_float(0u);
}
