/* A ray as the one-ray traversals keep it, and its test against one box.
 *
 * Boxes are widened by a few rounding errors at the ray's distance, so that no ray slips between
 * two that touch.
 */
#include "bvh/node.cl"

typedef struct {
    float3 o, d, r; /* r = 1 / d */
    float tmin;
} Ray;

/* False if a component is NaN or infinite: such a ray meets nothing. */
inline int ray_finite(float ox, float oy, float oz, float dx, float dy, float dz)
{
    return isfinite(ox) && isfinite(oy) && isfinite(oz) && isfinite(dx) && isfinite(dy) && isfinite(dz);
}

/* 1 / d, finite for d = 0, so that a slab's planes never make NaN. */
inline float ray_reciprocal(float d)
{
    return 1.0f / (fabs(d) > 1e-20f ? d : copysign(1e-20f, d));
}

inline Ray ray_make(float ox, float oy, float oz, float dx, float dy, float dz, float tmin)
{
    Ray ray = {(float3)(ox, oy, oz), (float3)(dx, dy, dz),
               (float3)(ray_reciprocal(dx), ray_reciprocal(dy), ray_reciprocal(dz)), tmin};
    return ray;
}

/* Where the ray enters a node's box between tmin and t; INFINITY if it does not. */
inline float ray_enter(const Ray *ray, float8 node, float t)
{
    float3 a = (node.s012 - ray->o) * ray->r, b = (node.s456 - ray->o) * ray->r;
    float3 near = fmin(a, b), far = fmax(a, b) * 1.0000005f;
    float entry = fmax(fmax(near.x, near.y), fmax(near.z, ray->tmin));
    float exit = fmin(fmin(far.x, far.y), fmin(far.z, t));
    return entry <= exit ? entry : INFINITY;
}
