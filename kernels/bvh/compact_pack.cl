/* Compressed nodes (bvh/compact.cl) from the collapse of a binary tree, without boxes and corners of triangles, which
 * bvh/refit.cl computes next.
 *
 * Siblings are reordered by their slots. So `places` keeps every node's number in the collapse, and the first item
 * of its subtree: a node's items come first, then each child's in turn. */
#include "bvh/no_vectorize.cl"
#include "bvh/collapsed.cl"
#include "bvh/items.cl"

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
