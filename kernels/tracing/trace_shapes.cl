/* The tree over analytic shapes, for traversals that go one ray a work-item. */
#include "bvh/ray.cl"
#if USES_ANALYTIC
typedef Scene ShapeTable;
inline int shape_intersect(Scene scene, uint prim, const Ray *ray, float *t)
{
    vec3 o = {ray->o.x, ray->o.y, ray->o.z}, d = {ray->d.x, ray->d.y, ray->d.z};
    ShapeHit hit = shape_hit(scene, (int)prim, shape_row_like(scene, (int)prim), o, d, ray->tmin, *t);
    if (!(hit.t < *t)) return 0;
    *t = hit.t;
    return 1;
}
#endif
