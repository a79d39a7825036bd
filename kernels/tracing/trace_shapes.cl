/* The tree over analytic shapes, for tracing with a ray a work-item. */
typedef Scene ShapeTable;
inline int shape_intersect(Scene scene, uint prim, float3 from, float3 along, float tmin, float *t)
{
    vec3 o = {from.x, from.y, from.z}, d = {along.x, along.y, along.z};
    ShapeHit hit = shape_hit(scene, (int)prim, shape_row_like(scene, (int)prim), o, d, tmin, *t);
    if (!(hit.t < *t)) return 0;
    *t = hit.t;
    return 1;
}
