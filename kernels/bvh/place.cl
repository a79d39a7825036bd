/* Instances by their transforms: rows of the table that traversal reads, and boxes in the world.
 *
 * A ray is turned into the group by the inverse as float has it, off by some roundings times the
 * matrix's condition; boxes are larger by as much.
 */
#include "generated/layout.cl"

#define ROUNDING 1e-6f

inline float3 rows_dot(const float3 *m, float3 v) { return (float3)(dot(m[0], v), dot(m[1], v), dot(m[2], v)); }

/* transforms: 16 floats each, rows of the matrix to the world; slots: where an instance's row stands;
 * begins: of each group's tree the nodes and the leaves, in steps of 32 bytes; boxes: low and high. */
kernel void place_instances(uint count, global const float *nodes, global const uint *begins,
                            global const uint *prototypes, global const float *transforms,
                            uint transforms_begin, global const uint *slots, global uint *instances,
                            global float *boxes)
{
    uint i = get_global_id(0);
    if (i >= count) return;
    global const float *matrix = transforms + transforms_begin + 16 * (size_t)i;
    global const uint *begin = begins + 2 * prototypes[i];
    float3 a[3], inverse[3], size[3], low, high;
    for (uint k = 0; k < 3; k++) a[k] = vload3(0, matrix + 4 * k);
    float3 origin = (float3)(matrix[3], matrix[7], matrix[11]);
    float3 x = cross(a[1], a[2]), y = cross(a[2], a[0]), z = cross(a[0], a[1]); /* Cramer's rule */
    float scale = 1.0f / dot(a[0], x);
    inverse[0] = (float3)(x.x, y.x, z.x) * scale;
    inverse[1] = (float3)(x.y, y.y, z.y) * scale;
    inverse[2] = (float3)(x.z, y.z, z.z) * scale;

    LAYOUT(bounds)(nodes + (size_t)begin[0] * 8, &low, &high);
    float condition = 0.0f, reverse = 0.0f;
    for (uint k = 0; k < 3; k++) {
        size[k] = fabs(a[k]);
        condition += dot(a[k], a[k]);
        reverse += dot(inverse[k], inverse[k]);
    }
    condition = sqrt(condition) * sqrt(reverse);
    float3 middle = rows_dot(a, 0.5f * (low + high)) + origin, half_ = rows_dot(size, 0.5f * (high - low));
    float3 far = rows_dot(size, fmax(fabs(low), fabs(high))) + fabs(origin);
    half_ += ROUNDING * condition * fmax(far.x, fmax(far.y, far.z));
    vstore3(middle - half_, 2 * i, boxes);
    vstore3(middle + half_, 2 * i + 1, boxes);

    global uint *row = instances + INSTANCE_ROW_WORDS * (size_t)slots[i]; /* as clpt/records.py has it */
    vstore3(as_uint3(origin), 0, row);
    for (uint k = 0; k < 3; k++) vstore3(as_uint3(inverse[k]), 1 + k, row);
    vstore4((uint4)(begin[0], begin[1], 0u, i), 3, row);
}
