/* A ray against a triangle record of bvh/leaves.cl: v0, v1, v2, n, prim, tag, plane, side. */
#include "bvh/hit.cl"
#include "bvh/ray.cl"
#include "bvh/shear.cl"

/* If the ray hits the triangle between tmin and hit->t, replaces the hit and returns 1. */
inline int triangle_intersect(global const float *record, const Shear *shear, float tmin, TriHit *hit)
{
    float t, u, v;
    int inside = shear_intersect(shear, record, 1, &t, &u, &v);
    if (!(inside && t > tmin && t < hit->t)) return 0;
    TriHit found = {t, u, v, as_uint(record[12]), as_uint(record[13]),
                    record[9], record[10], record[11], record[14], record[15]};
    *hit = found;
    return 1;
}
