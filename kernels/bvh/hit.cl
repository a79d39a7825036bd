/* A ray's hit of a triangle; every layout fills all members, so that shading needs no look-up.
 *
 * t in units of the ray's direction; u, v are the barycentrics of vertices 1 and 2; prim is the
 * index of the triangle in the caller's faces, BVH_MISS without a hit; tag is the caller's word for the
 * triangle; n = cross(v1 - v0, v2 - v0), not normalised: its length is twice the triangle's area;
 * plane = n . v0; side is the greatest coordinate of v1 - v0 and v2 - v0, the scale of t's rounding errors.
 * A hit has tmin < t < tmax.
 */
#include "bvh/no_vectorize.cl"

#define BVH_MISS 0xffffffffu

typedef struct { float t, u, v; uint prim, tag; float nx, ny, nz, plane, side; } TriHit;

inline float tri_side(float3 e1, float3 e2) { float3 e = fmax(fabs(e1), fabs(e2)); return fmax(e.x, fmax(e.y, e.z)); }

/* The hit of a triangle by its corner v0 and its sides from there. */
inline TriHit tri_hit(float t, float u, float v, uint prim, uint tag, float3 v0, float3 e1, float3 e2)
{
    float3 n = (float3)(e1.y * e2.z - e1.z * e2.y, e1.z * e2.x - e1.x * e2.z, e1.x * e2.y - e1.y * e2.x);
    TriHit hit = {t, u, v, prim, tag, n.x, n.y, n.z, dot(n, v0), tri_side(e1, e2)};
    return hit;
}

inline TriHit tri_miss(float tmax)
{
    TriHit hit = {tmax, 0.0f, 0.0f, BVH_MISS, 0u, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f};
    return hit;
}
