/* Shapes that move: their tables on the device are written anew. */

/* Step vertices: vertices [m] and normals are written anew into the scene's tables.
 *
 * A matrix is 16 floats, row after row, that take a shape's own space to the world; `<name>_begin` is the first element
 * of `name` in its buffer. Vertices `first` to first + count - 1 of the table are the shape's.
 */
#include "bvh/place.cl"

inline float3 place_row(global const float *matrix, uint row) { return vload3(0, matrix + 4 * row); }

inline float3 place_unit(float3 n)
{
    float3 size = fabs(n);
    float largest = fmax(fmax(size.x, size.y), size.z);
    n *= as_float(0x7f000000u - (as_uint(largest) & 0x7f800000u)); /* into [1, 2): cofactors may be huge */
    float length = sqrt(dot(n, n));
    return length > 0.0f ? n / length : (float3)(0.0f);
}

kernel void place_vertices(global const float *restrict source, uint source_begin,
                           global const float *restrict matrix, uint matrix_begin, uint first, uint count,
                           global float *restrict vertices)
{
    uint i = get_global_id(0);
    if (i >= count) return;
    matrix += matrix_begin;
    float3 p = vload3(i, source + source_begin), moved;
    moved.x = dot(place_row(matrix, 0), p) + matrix[3];
    moved.y = dot(place_row(matrix, 1), p) + matrix[7];
    moved.z = dot(place_row(matrix, 2), p) + matrix[11];
    vstore3(moved, first + i, vertices);
}

/* By the inverse transpose, which is the matrix of cofactors over the determinant. side: -1 where the
 * shape's normals are flipped, else 1. */
kernel void place_normals(global const float *restrict source, uint source_begin,
                          global const float *restrict matrix, uint matrix_begin, float side, uint first,
                          uint count, global float *restrict normals)
{
    uint i = get_global_id(0);
    if (i >= count) return;
    matrix += matrix_begin;
    float3 x = place_row(matrix, 0), y = place_row(matrix, 1), z = place_row(matrix, 2);
    float3 n = vload3(i, source + source_begin), cofactors = cross(y, z), turned;
    turned.x = dot(cofactors, n);
    turned.y = dot(cross(z, x), n);
    turned.z = dot(cross(x, y), n);
    vstore3(place_unit(turned) * copysign(side, side * dot(x, cofactors)), first + i, normals);
}

/* The mean of the triangles around a vertex, by their areas. `around` holds them vertex by
 * vertex, each vertex's from offsets[i] to offsets[i + 1]. */
kernel void smooth_normals(global const float *restrict vertices, global const uint *restrict faces,
                           global const uint *restrict offsets, global const uint *restrict around,
                           uint first, uint count, global float *restrict normals)
{
    uint i = get_global_id(0);
    if (i >= count) return;
    float3 sum = (float3)(0.0f);
    for (uint k = offsets[i]; k < offsets[i + 1]; k++) {
        uint face = 3 * around[k];
        float3 v0 = vload3(faces[face], vertices);
        sum += cross(vload3(faces[face + 1], vertices) - v0, vload3(faces[face + 2], vertices) - v0);
    }
    vstore3(place_unit(sum), first + i, normals);
}

/* An instance, whose row begins at word `at`; see bvh/place.cl. */
kernel void place_instance(global const float *restrict matrix, uint matrix_begin, float4 centre, float4 low,
                           float4 high, uint at, uint number, global uint *restrict instances,
                           global float *restrict boxes)
{
    placed_write(matrix + matrix_begin, centre.xyz, low.xyz, high.xyz, instances + at, boxes + 6 * number);
}

/* Step spheres: centres, and radii where these come along, go to the table `spheres`, and a box
 * around each to where the tree over shapes is fitted to. A work-item a sphere.
 *
 * A row of `source` is x y z, or x y z and the radius, before `matrix`: its first three rows to the
 * world [m]; `scale` is its factor of size. padding: of a box, relative, see
 * clpt.geometry.shapes.
 */
#define FARTHEST 1e12f /* so that products of three coordinates stay inside a float */

kernel void place_spheres(global const float *restrict source, uint source_begin, uint columns,
                          float16 matrix, float scale, float padding, uint first, uint first_box,
                          uint count, global float *restrict spheres, global float *restrict boxes)
{
    uint i = get_global_id(0);
    if (i >= count) return;
    global const float *row = source + source_begin + columns * i;
    float4 p = (float4)(vload3(0, row), 1.0f);
    float3 center = (float3)(dot(matrix.s0123, p), dot(matrix.s4567, p), dot(matrix.s89ab, p));
    float radius = columns > 3 ? row[3] * scale : spheres[4 * (first + i) + 3];
    float3 far = fabs(center);
    float reach = fmax(2.0f * radius, fmax(far.x, fmax(far.y, far.z)) + radius);
    /* A point that is nowhere, or no sphere, meets no ray, and its box must be a box all the same. */
    int real = isfinite(center.x + center.y + center.z) && radius > 0.0f && reach < FARTHEST;
    vstore4(real ? (float4)(center, radius) : (float4)(0.0f), first + i, spheres);
    center = real ? center : (float3)(0.0f);
    reach = real ? radius + padding * reach : 0.0f;
    vstore3(center - reach, 2 * (first_box + i), boxes);
    vstore3(center + reach, 2 * (first_box + i) + 1, boxes);
}
