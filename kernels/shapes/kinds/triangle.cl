/* A triangle as a light: sampled evenly over its area. Rays meet triangles through kernels/bvh. */
#include "core/rounding.cl"

ShapeSample triangle_sample(Triangle s, vec3 p, vec2 u)
{
    vec2 b = uniform_triangle(u);
    vec3 to = sub3(madd3(s.e1, b.x, madd3(s.e2, b.y, s.v0)), p), n = cross3(s.e1, s.e2);
    real t2 = max_r(dot3(to, to), (real)(1e-20f)), twice = wide_length3(n);
    ShapeSample r;
    r.t = sqrt(t2);
    r.wi = scale3(to, 1.0f / r.t);
    r.n = scale3(n, s.side / twice);
    r.uv.x = b.x; /* barycentrics, which the caller replaces by the mesh's uv */
    r.uv.y = b.y;
    r.size = triangle_size(max_r(size3(s.e1), size3(s.e2)), 1.0f / twice);
    r.pdf = solid_angle_pdf(2.0f / twice, r.t, fabs(dot3(r.n, r.wi)));
    return r;
}

real triangle_pdf(Triangle s, vec3 p, vec3 wi, real t, vec3 n)
{
    vec3 twice = cross3(s.e1, s.e2);
    return solid_angle_pdf(2.0f / wide_length3(twice), t, fabs(dot3(n, wi)));
}

/* Step emission: a point of a triangle as a light, evenly over its area [m]: see lights/emission.cl. uv are the
 * barycentrics of vertices 1 and 2, which the caller replaces by the mesh's uv. */
SurfacePoint triangle_point(Triangle s, vec2 u)
{
    vec2 b = uniform_triangle(u);
    vec3 n = cross3(s.e1, s.e2);
    real twice = wide_length3(n);
    SurfacePoint q;
    q.p = madd3(s.e1, b.x, madd3(s.e2, b.y, s.v0));
    q.n = scale3(n, s.side / twice);
    q.uv = b;
    q.area = 0.5f * twice;
    return q;
}
