/* Rays and a tree over shapes that the caller keeps: spheres, disks, cylinders.
 *
 * Before this file the includer defines the type ShapeTable and
 *     int shape_intersect(ShapeTable table, uint prim, float3 o, float3 d, float tmin, float *t)
 * which returns 1 and lowers *t if the ray meets shape `prim` between tmin and *t, and includes
 * bvh/shapes_binary.cl or bvh/shapes_wide8.cl, which have `shapes_trace`: the nearest shape, or with `first_only`
 * any; BVH_MISS without a hit. *t starts as the farthest distance. `indices`: the shape of each leaf's item.
 */
inline uint shapes_closest(global const float *nodes, global const uint *indices, ShapeTable table,
                           float ox, float oy, float oz, float dx, float dy, float dz, float tmin,
                           float *t)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return BVH_MISS;
    return shapes_trace(nodes, indices, table, (float3)(ox, oy, oz), (float3)(dx, dy, dz), tmin, t, 0);
}

inline int shapes_occluded(global const float *nodes, global const uint *indices, ShapeTable table,
                           float ox, float oy, float oz, float dx, float dy, float dz, float tmin,
                           float tmax)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return 0;
    float3 o = (float3)(ox, oy, oz), d = (float3)(dx, dy, dz);
    return shapes_trace(nodes, indices, table, o, d, tmin, &tmax, 1) != BVH_MISS;
}
