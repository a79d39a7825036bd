/* A rectangle as a light, sampled evenly over its area. Rays meet its two triangles. */
#include "core/rounding.cl"

ShapeSample rectangle_sample(Rectangle q, vec3 p, vec2 u)
{
    vec3 to = sub3(madd3(q.s, 2.0f * u.x - 1.0f, madd3(q.t, 2.0f * u.y - 1.0f, q.center)), p);
    vec3 quarter = cross3(q.s, q.t);
    real t2 = max_r(dot3(to, to), (real)(1e-20f)), area = 4.0f * wide_length3(quarter);
    ShapeSample r;
    r.t = sqrt(t2);
    r.wi = scale3(to, 1.0f / r.t);
    r.n = q.n;
    r.uv = u;
    r.size = triangle_size(2.0f * max_r(size3(q.s), size3(q.t)), 1.0f / area);
    r.pdf = solid_angle_pdf(1.0f / area, r.t, fabs(dot3(q.n, r.wi)));
    return r;
}

real rectangle_pdf(Rectangle q, vec3 p, vec3 wi, real t, vec3 n)
{
    vec3 quarter = cross3(q.s, q.t);
    return solid_angle_pdf(0.25f / wide_length3(quarter), t, fabs(dot3(q.n, wi)));
}

/* Step emission: a point of a rectangle as a light, evenly over its area [m]: see lights/emission.cl. */
SurfacePoint rectangle_point(Rectangle s, vec2 u)
{
    SurfacePoint q;
    q.p = madd3(s.s, 2.0f * u.x - 1.0f, madd3(s.t, 2.0f * u.y - 1.0f, s.center));
    q.n = s.n;
    q.uv = u;
    q.area = 4.0f * wide_length3(cross3(s.s, s.t));
    return q;
}
