/* Rays of work-items that trace a ray each, their hits, and their tests with boxes and triangles.
 *
 * Box: differences of coordinates come first, so that errors are relative to the distance from the ray's origin; far
 * planes move by a few such errors, so that no ray slips between two touching boxes.
 *
 * Triangle: the watertight test (Woop, Benthin and Wald 2013). Space is moved and sheared so that the ray runs along
 * +z from the origin; then a triangle is hit if the origin of the xy plane is on the same side of all its edges. Two
 * triangles see the same two points of a shared edge. Each product of the edge function is rounded by itself, and
 * rounding keeps order: a sign is never wrong, at worst the function is zero, which both sides take for inside.
 */
#include "bvh/hints.cl"
#include "bvh/node.cl"

#define BVH_MISS 0xffffffffu
#define RAY_WIDER 1.0000005f /* 1 + 2^-21 */

/* A ray's hit of a triangle; every layout fills all members, so that shading needs no look-up.
 *
 * t in units of the ray's direction, tmin < t < tmax; u, v are the barycentrics of vertices 1 and 2; prim is the index
 * of the triangle in the caller's faces, BVH_MISS without a hit; tag is the caller's word for the triangle;
 * n = cross(v1 - v0, v2 - v0), not normalised: its length is twice the triangle's area; plane = n . v0; side is the
 * greatest coordinate of v1 - v0 and v2 - v0, the scale of t's rounding errors. */
typedef struct { float t, u, v; uint prim, tag; float nx, ny, nz, plane, side; } TriHit;

inline float tri_side(float3 e1, float3 e2) { float3 e = fmax(fabs(e1), fabs(e2)); return fmax(e.x, fmax(e.y, e.z)); }

/* The hit of a triangle by its corner v0 and its sides from there. */
inline TriHit tri_hit(float t, float u, float v, uint prim, uint tag, float3 v0, float3 e1, float3 e2)
{
    float3 n = (float3)(e1.y * e2.z - e1.z * e2.y, e1.z * e2.x - e1.x * e2.z, e1.x * e2.y - e1.y * e2.x);
    return (TriHit){t, u, v, prim, tag, n.x, n.y, n.z, dot(n, v0), tri_side(e1, e2)};
}

inline TriHit tri_miss(float tmax) { return (TriHit){tmax, 0.0f, 0.0f, BVH_MISS, 0u, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f}; }

/* The arrays for all hits of a ray, in the traversal's order. With null pointers a traversal only counts. `begin` is
 * the index of the ray's first hit. */
typedef struct { ulong begin; global float *t, *barycentrics; global int *primitive; } HitList;

inline void hit_list_put(HitList list, uint number, TriHit hit)
{
    if (!list.t) return;
    ulong at = list.begin + number;
    list.t[at] = hit.t;
    list.primitive[at] = as_int(hit.prim);
    list.barycentrics[2 * at] = hit.u;
    list.barycentrics[2 * at + 1] = hit.v;
}

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
    return (Ray){(float3)(ox, oy, oz), (float3)(dx, dy, dz),
                 (float3)(ray_reciprocal(dx), ray_reciprocal(dy), ray_reciprocal(dz)), tmin};
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

typedef struct {
    uint kx, ky, kz; /* axes: kz is the direction's largest */
    float x, y, z;   /* x' = x - shear.x * z, y' = y - shear.y * z, z' = shear.z * z */
    float ox, oy, oz; /* the origin, by the axes above */
} Shear;

inline Shear shear_make(float ox, float oy, float oz, float dx, float dy, float dz)
{
    float ax = fabs(dx), ay = fabs(dy), az = fabs(dz);
    Shear s;
    s.kz = az >= ax ? (az >= ay ? 2 : 1) : (ax >= ay ? 0 : 1);
    s.kx = s.kz == 2 ? 0 : s.kz + 1;
    s.ky = s.kx == 2 ? 0 : s.kx + 1;
    float d[3] = {dx, dy, dz}, o[3] = {ox, oy, oz};
    s.z = 1.0f / d[s.kz];
    s.x = d[s.kx] * s.z;
    s.y = d[s.ky] * s.z;
    s.ox = o[s.kx];
    s.oy = o[s.ky];
    s.oz = o[s.kz];
    return s;
}

inline float shear_edge(float px, float py, float qx, float qy)
{
#pragma OPENCL FP_CONTRACT OFF
    return px * qy - py * qx;
}

/* The body of a function that tests a triangle, see `shear_intersect`. */
#define SHEAR_INTERSECT                                                                               \
    float az = v[s->kz * step] - s->oz, bz = v[(3 + s->kz) * step] - s->oz;                           \
    float cz = v[(6 + s->kz) * step] - s->oz;                                                         \
    float ax = mad(-s->x, az, v[s->kx * step] - s->ox), ay = mad(-s->y, az, v[s->ky * step] - s->oy); \
    float bx = mad(-s->x, bz, v[(3 + s->kx) * step] - s->ox);                                         \
    float by = mad(-s->y, bz, v[(3 + s->ky) * step] - s->oy);                                         \
    float cx = mad(-s->x, cz, v[(6 + s->kx) * step] - s->ox);                                         \
    float cy = mad(-s->y, cz, v[(6 + s->ky) * step] - s->oy);                                         \
    float e0 = shear_edge(cx, cy, bx, by), e1 = shear_edge(ax, ay, cx, cy);                           \
    float e2 = shear_edge(bx, by, ax, ay), inverse = 1.0f / (e0 + e1 + e2);                           \
    *t = (e0 * az + e1 * bz + e2 * cz) * s->z * inverse;                                              \
    *b1 = e1 * inverse;                                                                               \
    *b2 = e2 * inverse;                                                                               \
    return (e0 >= 0.0f && e1 >= 0.0f && e2 >= 0.0f) || (e0 <= 0.0f && e1 <= 0.0f && e2 <= 0.0f);

/* Whether the ray's line hits a triangle with nine coordinates `step` floats apart; its distance, and the barycentrics
 * of vertices 1 and 2. */
inline int shear_intersect(const Shear *s, global const float *v, uint step, float *t, float *b1,
                           float *b2) { SHEAR_INTERSECT }

/* If the ray hits the triangle of a record of bvh/leaves.cl (v0, v1, v2, n, prim, tag, plane, side) between tmin and
 * hit->t, replaces the hit and returns 1. */
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
