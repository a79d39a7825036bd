/* Every triangle against every ray, in lanes: the layout for tiny scenes.
 *
 * `tris` holds a record of 16 floats for each triangle, in the caller's order: v0, e1 = v1 - v0,
 * e2 = v2 - v0, n = cross(e1, e2), prim, tag, plane, side as of TriHit. A record is read once and tested against
 * all lanes of the work-item.
 */
#include "bvh/ray.cl"
#include "core/lanes.cl"

#define BRUTE_EDGE 2e-6f

typedef struct { real t, u, v; natural prim, tag; vec3 n; real plane, side; } BruteHit;

/* The lanes that meet a record between tmin and tmax. With s = v0 - o and w = s x d, Cramer's rule
 * gives t = s.n / d.n, u = e2.w / d.n, v = -e1.w / d.n. Triangles reach a few rounding errors beyond
 * their edges, so that no ray slips between two of them. */
inline mask brute_test(global const float *tri, vec3 o, vec3 d, real tmin, real tmax, real *t, real *u,
                       real *v)
{
    real sx = tri[0] - o.x, sy = tri[1] - o.y, sz = tri[2] - o.z;
    real wx = sy * d.z - sz * d.y;
    real wy = sz * d.x - sx * d.z;
    real wz = sx * d.y - sy * d.x;
    real inverse = 1.0f / (tri[9] * d.x + tri[10] * d.y + tri[11] * d.z);
    *t = (tri[9] * sx + tri[10] * sy + tri[11] * sz) * inverse;
    *u = (tri[6] * wx + tri[7] * wy + tri[8] * wz) * inverse;
    *v = (tri[3] * wx + tri[4] * wy + tri[5] * wz) * -inverse;
    mask inside = (min_r(*u, *v) >= -BRUTE_EDGE) & (*u + *v <= 1.0f + BRUTE_EDGE);
    return inside & (*t > tmin) & (*t < tmax);
}

/* The nearest hit of each active lane between tmin and tmax; prim is BVH_MISS where there is none. */
inline BruteHit brute_closest(global const float *tris, uint count, vec3 o, vec3 d, real tmin,
                              real tmax, mask active)
{
    BruteHit hit;
    real t, u, v;
    integer prim = (integer)(-1);
    hit.t = sel(active, tmax, (real)(-INFINITY));
    hit.u = hit.v = (real)(0.0f);
    for (uint i = 0; i < count; i++) {
        mask nearer = brute_test(tris + 16 * i, o, d, tmin, hit.t, &t, &u, &v);
        hit.t = sel(nearer, t, hit.t);
        hit.u = sel(nearer, u, hit.u);
        hit.v = sel(nearer, v, hit.v);
        prim = sel_i(nearer, (integer)((int)i), prim);
    }
    integer at = sel_i(prim >= 0, prim * 16, (integer)(0));
    hit.t = sel(prim >= 0, hit.t, tmax);
    hit.prim = as_natural(prim);
    hit.tag = as_natural(gather_i((global const uint *)tris, at + 13));
    hit.n.x = gather(tris, at + 9);
    hit.n.y = gather(tris, at + 10);
    hit.n.z = gather(tris, at + 11);
    hit.plane = gather(tris, at + 14);
    hit.side = gather(tris, at + 15);
    return hit;
}

/* The active lanes that have anything between tmin and tmax. */
inline mask brute_occluded(global const float *tris, uint count, vec3 o, vec3 d, real tmin, real tmax,
                           mask active)
{
    real t, u, v, far = sel(active, tmax, (real)(-INFINITY));
    mask open = active;
    for (uint i = 0; i < count && any(open); i++)
        open = open & !brute_test(tris + 16 * i, o, d, tmin, far, &t, &u, &v);
    return active & !open;
}
