/* Traversal for an application's kernels, in any layout, with a ray a work-item. BVH_ARGS are a kernel's arguments, by
 * the names in `Accel.buffers`; BVH passes them on. */
#include "generated/layout.cl"

#define BVH_ARGS global const float *nodes, global const float *leaves
#define BVH nodes, leaves

/* The nearest triangle between tmin and tmax, in units of d; `prim` is BVH_MISS without a hit. */
inline TriHit bvh_closest(BVH_ARGS, float3 o, float3 d, float tmin, float tmax)
{
    return LAYOUT(closest)(BVH, o.x, o.y, o.z, d.x, d.y, d.z, tmin, tmax);
}

/* Whether there is any triangle between tmin and tmax. */
inline int bvh_occluded(BVH_ARGS, float3 o, float3 d, float tmin, float tmax)
{
    return LAYOUT(occluded)(BVH, o.x, o.y, o.z, d.x, d.y, d.z, tmin, tmax);
}
