/* Spheres that move: their centres, and radii where these come along, go to the table `spheres`, and a box
 * around each to where the tree over shapes is fitted to. One work-item a sphere.
 *
 * A row of `source` is x y z, or x y z and the radius, before `matrix`: its first three rows, which take it
 * to the world [m]; `scale` is by how much it enlarges. padding: of a box, relative, see
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
    /* What is nowhere, or no sphere, is met by no ray, and its box must be one all the same. */
    int real = isfinite(center.x + center.y + center.z) && radius > 0.0f && reach < FARTHEST;
    vstore4(real ? (float4)(center, radius) : (float4)(0.0f), first + i, spheres);
    center = real ? center : (float3)(0.0f);
    reach = real ? radius + padding * reach : 0.0f;
    vstore3(center - reach, 2 * (first_box + i), boxes);
    vstore3(center + reach, 2 * (first_box + i) + 1, boxes);
}
