/* A point of a triangle as a light, evenly over its area [m]: see lights/emission.cl. uv are the barycentrics of
 * vertices 1 and 2, which the caller makes the mesh's. */
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
