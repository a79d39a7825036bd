/* An instance's row and its box in the world, from its transform.
 *
 * A ray is transformed into the group by the inverse in float. The error is some roundings times the matrix's
 * condition, and the box is enlarged by it. A singular transform gives a box that is not finite, which trees
 * leave out.
 */
#define PLACED_ROUNDING 1e-6f

inline float3 placed_dot(const float3 *m, float3 v) { return (float3)(dot(m[0], v), dot(m[1], v), dot(m[2], v)); }

/* matrix: 16 floats, row by row, to the world; middle: the origin of the group's triangles in the matrix's source
 * space; low, high: their box around it; row: see clpt/records. */
inline void placed_write(global const float *matrix, float3 middle, float3 low, float3 high, global uint *row,
                         global float *box)
{
    float3 a[3], inverse[3], size[3];
    for (uint k = 0; k < 3; k++) a[k] = vload3(0, matrix + 4 * k);
    float3 origin = (float3)(matrix[3], matrix[7], matrix[11]) + placed_dot(a, middle);
    float3 x = cross(a[1], a[2]), y = cross(a[2], a[0]), z = cross(a[0], a[1]); /* Cramer's rule */
    float scale = 1.0f / dot(a[0], x);
    inverse[0] = (float3)(x.x, y.x, z.x) * scale;
    inverse[1] = (float3)(x.y, y.y, z.y) * scale;
    inverse[2] = (float3)(x.z, y.z, z.z) * scale;

    float condition = 0.0f, reverse = 0.0f;
    for (uint k = 0; k < 3; k++) {
        size[k] = fabs(a[k]);
        condition += dot(a[k], a[k]);
        reverse += dot(inverse[k], inverse[k]);
    }
    condition = sqrt(condition) * sqrt(reverse);
    float3 center = placed_dot(a, 0.5f * (low + high)) + origin, half_ = placed_dot(size, 0.5f * (high - low));
    float3 far = placed_dot(size, fmax(fabs(low), fabs(high))) + fabs(origin);
    half_ += PLACED_ROUNDING * condition * fmax(far.x, fmax(far.y, far.z));
    vstore3(center - half_, 0, box);
    vstore3(center + half_, 1, box);
    vstore3(as_uint3(origin), 0, row);
    for (uint k = 0; k < 3; k++) vstore3(as_uint3(inverse[k]), 1 + k, row);
}

/* Step instances: rows and boxes of instances by their transforms. */
#include "generated/layout.cl"

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
