/* One ray against one triangle record of pack.cl. */
#include "bvh/hit.cl"
#include "bvh/ray.cl"

/* If the ray meets the triangle between tmin and hit->t, the record becomes that hit and 1 is
 * returned. With s = v0 - o and w = s x d, Cramer's rule gives t = s.n / d.n, u = e2.w / d.n,
 * v = -e1.w / d.n; edges belong to both sides. */
inline int triangle_intersect(global const float *record, const Ray *ray, TriHit *hit)
{
    float3 s = vload3(0, record) - ray->o, n = vload3(3, record);
    float3 w = cross(s, ray->d);
    float inverse = 1.0f / dot(n, ray->d);
    float t = dot(n, s) * inverse, u = dot(vload3(2, record), w) * inverse;
    float v = -dot(vload3(1, record), w) * inverse;
    if (!(fmin(u, v) >= 0.0f && u + v <= 1.0f && t > ray->tmin && t < hit->t)) return 0;
    TriHit found = {t, u, v, as_uint(record[12]), as_uint(record[13]), n.x, n.y, n.z};
    *hit = found;
    return 1;
}
