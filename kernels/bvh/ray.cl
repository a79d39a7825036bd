/* A ray for single-ray traversals, and its test with a box.
 *
 * Differences of coordinates come first, so that errors are relative to the distance from the ray's origin; far
 * planes move by a few such errors, so that no ray slips between two touching boxes.
 */
#include "bvh/node.cl"

#define RAY_WIDER 1.0000005f /* 1 + 2^-21 */

typedef struct {
    float3 o, d, r; /* r = 1 / d */
    float tmin;
} Ray;

/* Like hardware; the library's fmin and fmax handle NaN at many times the cost. */
inline float ray_min(float a, float b) { return a < b ? a : b; }
inline float ray_max(float a, float b) { return a > b ? a : b; }

/* False if a component is NaN or infinite: such a ray hits nothing. */
inline int ray_finite(float ox, float oy, float oz, float dx, float dy, float dz)
{
    return isfinite(ox) && isfinite(oy) && isfinite(oz) && isfinite(dx) && isfinite(dy) && isfinite(dz);
}

/* 1 / d, finite for d = 0, so that a slab's planes never make NaN. */
inline float ray_reciprocal(float d) { return 1.0f / (fabs(d) > 1e-20f ? d : copysign(1e-20f, d)); }

inline Ray ray_make(float ox, float oy, float oz, float dx, float dy, float dz, float tmin)
{
    Ray ray = {(float3)(ox, oy, oz), (float3)(dx, dy, dz),
               (float3)(ray_reciprocal(dx), ray_reciprocal(dy), ray_reciprocal(dz)), tmin};
    return ray;
}

/* The ray's entry distance into a node's box between tmin and t; INFINITY without entry. */
inline float ray_enter(const Ray *ray, float8 node, float t)
{
    float x0 = (node.s0 - ray->o.x) * ray->r.x, x1 = (node.s4 - ray->o.x) * ray->r.x;
    float y0 = (node.s1 - ray->o.y) * ray->r.y, y1 = (node.s5 - ray->o.y) * ray->r.y;
    float z0 = (node.s2 - ray->o.z) * ray->r.z, z1 = (node.s6 - ray->o.z) * ray->r.z;
    float near = ray_max(ray_max(ray_min(x0, x1), ray_min(y0, y1)), ray_min(z0, z1));
    float far = ray_min(ray_min(ray_max(x0, x1), ray_max(y0, y1)), ray_max(z0, z1));
    near = ray_max(near, ray->tmin);
    far = ray_max(far, far * RAY_WIDER); /* negative values stay */
    return near <= ray_min(far, t) ? near : INFINITY;
}
