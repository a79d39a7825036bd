/* What a ray meets among triangles; filled by every layout, so that shading needs no look-up.
 *
 * t in units of the ray's direction; u, v are the barycentrics of vertices 1 and 2; prim is the
 * index of the triangle in the caller's faces, BVH_MISS if there is none; tag is the caller's word
 * for it; n = cross(v1 - v0, v2 - v0), not normalised: its length is twice the triangle's area.
 * A hit has tmin < t < tmax.
 */
#include "bvh/no_vectorize.cl"

#define BVH_MISS 0xffffffffu

typedef struct { float t, u, v; uint prim, tag; float nx, ny, nz; } TriHit;

inline TriHit tri_miss(float tmax)
{
    TriHit hit = {tmax, 0.0f, 0.0f, BVH_MISS, 0u, 0.0f, 0.0f, 0.0f};
    return hit;
}
