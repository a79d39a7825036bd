/* Strands of many pieces in a single shape: the row at `params` of `geometry` has the members that they share, and
 * their place in `spheres`. A piece has the functions of kernels/shapes/kinds/curve.cl. */

#include "generated/curve_sizes.cl"

/* The piece of primitive `prim`, where `active`; elsewhere any piece. */
inline Curve curves_one(Scene scene, integer params, integer prim, mask active)
{
    Curve q = curve_row(scene.geometry, params);
    integer at = sel_i(active, q.first + CURVE_WORDS * prim, (integer)(0));
    vec4 a = gather4(scene.spheres, at), b = gather4(scene.spheres, at + 4);
    vec4 c = gather4(scene.spheres, at + 8), d = gather4(scene.spheres, at + 12);
    q.p0 = v3(a.x, b.x, c.x);
    q.p1 = v3(a.y, b.y, c.y);
    q.p2 = v3(a.z, b.z, c.z);
    q.p3 = v3(a.w, b.w, c.w);
    q.r0 = d.x;
    q.r1 = d.y;
    q.r2 = d.z;
    q.r3 = d.w;
    vec4 e = gather4(scene.spheres, at + 16);
    q.axis = v3(e.x, e.y, e.z);
    q.v = e.w;
    q.dv = gather(scene.spheres, at + 20);
    return q;
}
