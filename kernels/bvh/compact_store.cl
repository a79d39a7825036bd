/* Boxes into a node of bvh/compact.cl, in steps of a byte: never smaller than they were.
 *
 * Traversals have the planes as p + byte * step, with errors of 2^-23 of the node's extent, which is 256 steps at
 * most; so boxes are larger by COMPACT_MARGIN of a step. Moving far planes farther covers errors relative to the
 * distance from the ray's origin. */
#include "bvh/leaves.cl"
#include "bvh/node.cl"

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
