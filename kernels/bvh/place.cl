/* Instances by their transforms: rows of the table that traversal reads, and boxes in the world. */
#include "generated/layout.cl"
#include "bvh/placed.cl"

/* transforms: 16 floats each, rows of the matrix to the world; slots: where an instance's row stands;
 * begins: of each group's tree the nodes and the leaves, in steps of 32 bytes; boxes: low and high. */
kernel void place_instances(uint count, global const float *nodes, global const uint *begins,
                            global const uint *prototypes, global const float *transforms,
                            uint transforms_begin, global const uint *slots, global uint *instances,
                            global float *boxes)
{
    uint i = get_global_id(0);
    if (i >= count) return;
    global const uint *begin = begins + 2 * prototypes[i];
    global uint *row = instances + INSTANCE_ROW_WORDS * (size_t)slots[i];
    float3 low, high;
    LAYOUT(bounds)(nodes + (size_t)begin[0] * 8, &low, &high);
    placed_write(transforms + transforms_begin + 16 * (size_t)i, (float3)(0.0f), low, high, row, boxes + 6 * (size_t)i);
    vstore4((uint4)(begin[0], begin[1], 0u, i), 3, row);
}
