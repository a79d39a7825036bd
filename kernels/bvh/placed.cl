/* An instance's row and its box in the world, from its transform.
 *
 * A ray is transformed into the group by the inverse in float. The error is some roundings times the matrix's
 * condition, and the box is enlarged by it. A singular transform gives a box that is not finite, which trees
 * leave out.
 */
#define PLACED_ROUNDING 1e-6f

inline float3 placed_dot(const float3 *m, float3 v) { return (float3)(dot(m[0], v), dot(m[1], v), dot(m[2], v)); }

/* matrix: 16 floats, row by row, to the world; middle: the origin of the group's triangles in the matrix's source
 * space; low, high: their box around it; row: see clpt/records.py. */
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
