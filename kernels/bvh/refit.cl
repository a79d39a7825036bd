/* Refits of trees to moved triangles or boxes: nodes and leaves stay, boxes are computed from the leaves up.
 *
 * Boxes equal the builder's, so that a tree with unmoved triangles stays the same to the bit. Triangles that
 * are not finite, or beyond a tree's reach, are left out: nothing hits them. An empty box is inverted, but in
 * a binary node it is a point beyond everything, for its traversals sort the planes of a box.
 */
#include "bvh/leaves.cl"

#define REFIT_NOTHING ((float8)(FLT_MAX))

/* The content of leaves: triangles or, if `boxes` is not null, boxes by their `indices`. */
typedef struct {
    global float *leaves;
    global const float *vertices, *boxes;
    global const uint *faces, *indices;
    float reach; /* the largest coordinate at the build */
} Refit;

inline float8 refit_pad(float8 bounds, float reach)
{
    float8 far = fabs(bounds);
    float4 own = fmax(far.lo, far.hi);
    return node_pad(bounds, fmax(reach, fmax(own.x, fmax(own.y, own.z))));
}

inline float8 refit_triangle(const float4 v[3])
{
    return (float8)(fmin(v[0], fmin(v[1], v[2])), -fmax(v[0], fmax(v[1], v[2])));
}

inline float8 refit_box(Refit tree, uint item)
{
    uint at = 2 * tree.indices[item];
    float4 lo = (float4)(vload3(at, tree.boxes), 0.0f), hi = (float4)(vload3(at + 1, tree.boxes), 0.0f);
    int4 sound = (lo <= hi) & (fabs(lo) < BVH_REACH) & (fabs(hi) < BVH_REACH);
    return all(sound) ? (float8)(lo, -hi) : REFIT_NOTHING;
}

/* Writes the records of items first .. first + count - 1 of a binary tree, and returns their bounds. */
inline float8 refit_records(Refit tree, uint first, uint count)
{
    float8 bounds = REFIT_NOTHING;
    for (uint i = first; i < first + count; i++) {
        if (tree.boxes) {
            bounds = item_union(bounds, refit_box(tree, i));
            continue;
        }
        float4 corners[3];
        global float *record = tree.leaves + (ulong)i * 16;
        int sound = leaf_corners(tree.vertices, tree.faces, as_uint(record[12]), corners);
        leaf_store_record(record, corners);
        if (sound) bounds = item_union(bounds, refit_triangle(corners));
    }
    return bounds;
}

/* Writes a block and returns its bounds. */
inline float8 refit_block(Refit tree, uint block)
{
    if (tree.boxes) return refit_box(tree, block);
    return leaf_store_block(tree.leaves + (ulong)block * 88, tree.vertices, tree.faces);
}

/* A binary node's padded bounds. */
inline float8 refit_bounds(float8 node) { return node.s0 < FLT_MAX ? (float8)(node.lo, -node.hi) : REFIT_NOTHING; }

inline void refit_node(global float8 *nodes, Refit tree, uint at)
{
    float8 node = nodes[at], bounds;
    uint link = node_link(node);
    if (node_is_leaf(node)) {
        bounds = refit_records(tree, link, node_count(node));
        if (bounds.s0 < FLT_MAX) bounds = refit_pad(bounds, tree.reach);
    } else {
        bounds = item_union(refit_bounds(nodes[link]), refit_bounds(nodes[link + 1]));
    }
    if (bounds.s0 == FLT_MAX) bounds.hi = (float4)(-FLT_MAX);
    nodes[at] = node_make(bounds, as_uint(node.s3), as_uint(node.s7));
}

/* Offsets of a tree's nodes and leaves are in units of 32 bytes, of its faces in triangles. */
inline Refit refit_tree(global float *leaves, uint leaves_begin, global const float *vertices,
                        global const uint *faces, uint faces_begin, global const uint *indices,
                        global const float *boxes, float reach)
{
    return (Refit){leaves + (ulong)leaves_begin * 8, vertices, boxes, faces + (ulong)faces_begin * 3,
                   indices, reach};
}

#define REFIT_ARGS                                                                                \
    global float *leaves, uint leaves_begin, global const float *restrict vertices,               \
        global const uint *restrict faces, uint faces_begin, global const uint *restrict indices, \
        global const float *restrict boxes, float reach
#define REFIT refit_tree(leaves, leaves_begin, vertices, faces, faces_begin, indices, boxes, reach)

/* The subtrees of build_subtree, children before parents. */
kernel NO_VECTORIZE void refit_subtree(global float8 *nodes, uint nodes_begin, global const Range *restrict ranges,
                                       uint begin, REFIT_ARGS)
{
    Refit tree = REFIT;
    Range r = ranges[begin + get_global_id(0)];
    uint waiting[2 * BVH_DEPTH + 2]; /* node; BVH_LEAF is set after its children were pushed */
    int n = 0;
    nodes += nodes_begin;
    if (r.count) waiting[n++] = r.node;
    while (n) {
        uint at = waiting[n - 1];
        float8 node = nodes[at & ~BVH_LEAF];
        if (at & BVH_LEAF || node_is_leaf(node)) {
            refit_node(nodes, tree, at & ~BVH_LEAF);
            n--;
        } else {
            waiting[n - 1] |= BVH_LEAF;
            waiting[n++] = node_link(node) + 1;
            waiting[n++] = node_link(node);
        }
    }
}

/* A level of the heap of ranges, after the levels below. */
kernel NO_VECTORIZE void refit_level(global float8 *nodes, uint nodes_begin, global const Range *restrict ranges,
                                     uint begin, REFIT_ARGS)
{
    Range r = ranges[begin + get_global_id(0)];
    if (r.count) refit_node(nodes + nodes_begin, REFIT, r.node);
}

/* Nodes of a tree of bvh/clusters.cl, from `begin` on, after the rounds before. Empty nodes are unused. */
kernel NO_VECTORIZE void refit_pairs(global float8 *nodes, uint nodes_begin, uint begin, uint count, REFIT_ARGS)
{
    uint at = begin + get_global_id(0);
    nodes += nodes_begin;
    if (get_global_id(0) < count && node_count(nodes[at])) refit_node(nodes, REFIT, at);
}

/* A level of wide nodes, from `begin` on, after the levels below. */
kernel NO_VECTORIZE void refit_wide8(global float8 *nodes, uint nodes_begin, uint begin, uint count, REFIT_ARGS)
{
    if (get_global_id(0) >= count) return;
    Refit tree = REFIT;
    nodes += nodes_begin;
    global float *row = (global float *)(nodes + (ulong)(begin + get_global_id(0)) * 8);
    for (uint k = 0; k < 8; k++, row++) {
        if (as_uint(row[56]) == 0) continue;
        uint word = as_uint(row[48]);
        float8 bounds;
        if (word & BVH_LEAF) {
            bounds = refit_block(tree, word & ~BVH_LEAF);
            if (bounds.s0 < FLT_MAX) bounds = refit_pad(bounds, tree.reach);
        } else {
            global const float8 *child = nodes + (ulong)word * 8;
            bounds.lo = (float4)(leaf_least(child[0]), leaf_least(child[2]), leaf_least(child[4]), 0.0f);
            bounds.hi = (float4)(leaf_least(-child[1]), leaf_least(-child[3]), leaf_least(-child[5]), 0.0f);
        }
        row[0] = bounds.s0;
        row[8] = -bounds.s4;
        row[16] = bounds.s1;
        row[24] = -bounds.s5;
        row[32] = bounds.s2;
        row[40] = -bounds.s6;
    }
}

/* Wide nodes that follow a binary tree: each child has the box of its binary node. */
kernel NO_VECTORIZE void refit_followers(global const float8 *restrict binary, global const uint *restrict totals,
                                         uint count, global float *restrict nodes)
{
    if (get_global_id(0) >= min(count, totals[0])) return;
    global float *row = nodes + (ulong)get_global_id(0) * 64;
    for (uint k = 0; k < 8; k++, row++) {
        if (as_uint(row[56]) == 0) continue;
        float8 node = binary[as_uint(row[56]) - 1];
        if (node.s0 == FLT_MAX) node.hi = (float4)(-FLT_MAX);
        row[0] = node.s0;
        row[8] = node.s4;
        row[16] = node.s1;
        row[24] = node.s5;
        row[32] = node.s2;
        row[40] = node.s6;
    }
}

/* Copies a buffer of a new tree over an old tree's, unless the new tree exceeds the room for wide nodes. A work-item
 * has 16 words. */
kernel NO_VECTORIZE void refit_adopt(global const uint *restrict totals, uint room, uint count, uint words,
                                     global const uint *restrict made, global uint *restrict adopts)
{
    if (get_global_id(0) >= count || totals[0] > room) return;
    uint begin = get_global_id(0) * 16, end = min(begin + 16, words);
    for (uint i = begin; i < end; i++) adopts[i] = made[i];
}

/* Boxes into a node of bvh/compact.cl, in steps of a byte: never smaller than they were. Traversals have the planes as
 * p + byte * step, with errors of 2^-23 of the node's extent, which is 256 steps at most; so boxes are larger by
 * COMPACT_MARGIN of a step. Moving far planes farther covers errors relative to the distance from the ray's origin. */
#define COMPACT_MARGIN 0x1p-10f
#define COMPACT_STEPS 250.0f /* over the node's extent, at most; some are left for margins */
#define COMPACT_LEAST 27u    /* 2^-100: the shortest step's exponent, so that no plane is denormal */

/* The biased exponent of the least power of two that covers `extent` in COMPACT_STEPS steps. */
inline uint compact_exponent(float extent)
{
    return max((as_uint(extent / COMPACT_STEPS) + 0x7fffffu) >> 23, COMPACT_LEAST);
}

/* Planes of an axis; returns the step's exponent. Slots that are not `there` get planes that no ray hits. */
inline uint compact_axis(global uint *node, uint axis, float8 low, float8 high, int8 there)
{
    float least = leaf_least(low), most = -leaf_least(-high);
    if (!any(there)) least = most = 0.0f;
    uint exponent = compact_exponent(most - least + fabs(least) * 0x1p-21f);
    float step = as_float(exponent << 23), inverse = as_float((254 - exponent) << 23);
    float p = least - (step * 0x1p-8f + fabs(least) * 0x1p-22f);
    float8 first = floor((low - p) * inverse - COMPACT_MARGIN), last = ceil((high - p) * inverse + COMPACT_MARGIN);
    first = there ? first : (float8)(255.0f);
    last = there ? last : (float8)(0.0f);
    node[axis] = as_uint(p);
    vstore2(as_uint2(convert_uchar8_sat(first)), 4 + axis, node);
    vstore2(as_uint2(convert_uchar8_sat(last)), 7 + axis, node);
    return exponent;
}

#define COMPACT_ROW(b, lane) \
    (float8)(b[0].lane, b[1].lane, b[2].lane, b[3].lane, b[4].lane, b[5].lane, b[6].lane, b[7].lane)

/* boxes: low corner and negated high corner of the slots' contents, FLT_MAX for empty slots. */
inline void compact_store(global uint *node, const float8 boxes[8])
{
    int8 there = COMPACT_ROW(boxes, s0) < FLT_MAX;
    uint x = compact_axis(node, 0, COMPACT_ROW(boxes, s0), -COMPACT_ROW(boxes, s4), there);
    uint y = compact_axis(node, 1, COMPACT_ROW(boxes, s1), -COMPACT_ROW(boxes, s5), there);
    uint z = compact_axis(node, 2, COMPACT_ROW(boxes, s2), -COMPACT_ROW(boxes, s6), there);
    node[3] = (node[3] & 0xff000000u) | z << 16 | y << 8 | x;
}

/* Writes the record of item `at` of a compressed tree, and returns its bounds. */
inline float8 refit_item(Refit tree, uint at)
{
    if (tree.boxes) return refit_box(tree, at);
    float4 v[3];
    global float *record = tree.leaves + (ulong)at * 12;
    int sound = leaf_corners(tree.vertices, tree.faces, as_uint(record[9]), v);
    for (uint i = 0; i < 3; i++) vstore3(v[i].xyz, i, record);
    return sound ? refit_triangle(v) : REFIT_NOTHING;
}

/* A level of compressed nodes, from `begin` on, after the levels below. bounds: of every node, before rounding to
 * steps, so that boxes do not grow from level to level. */
kernel NO_VECTORIZE void refit_compact(global float8 *nodes, uint nodes_begin, global float8 *restrict bounds,
                                       uint begin, uint count, REFIT_ARGS)
{
    if (get_global_id(0) >= count) return;
    Refit tree = REFIT;
    uint at = begin + get_global_id(0);
    global uint *node = (global uint *)(nodes + nodes_begin) + (ulong)at * COMPACT_WORDS;
    uint mask = node[3] >> 24, child = node[4];
    float8 rows[8], whole = REFIT_NOTHING;
    for (uint slot = 0; slot < 8; slot++) {
        uint meta = node[6 + slot / 4] >> 8 * (slot % 4) & 0xffu;
        rows[slot] = REFIT_NOTHING;
        if (mask >> slot & 1) {
            rows[slot] = bounds[child++];
        } else if (meta) {
            uint first = node[5] + (meta & 31u);
            for (uint i = 0; i < popcount(meta >> 5); i++)
                rows[slot] = item_union(rows[slot], refit_item(tree, first + i));
            if (rows[slot].s0 < FLT_MAX) rows[slot] = refit_pad(rows[slot], tree.reach);
        }
        whole = item_union(whole, rows[slot]);
    }
    bounds[at] = whole;
    compact_store(node, rows);
}

/* The records of bvh/brute.cl; prim and tag stay. */
kernel NO_VECTORIZE void refit_brute(global float *restrict records, global const float *restrict vertices,
                                     global const uint *restrict faces, uint count)
{
    uint prim = get_global_id(0);
    if (prim >= count) return;
    float4 corners[3];
    leaf_corners(vertices, faces, prim, corners);
    leaf_store_brute(records + (ulong)prim * 16, corners);
}
