/* A point of a rectangle as a light, evenly over its area [m]: see lights/emission.cl. */
SurfacePoint rectangle_point(Rectangle s, vec2 u)
{
    SurfacePoint q;
    q.p = madd3(s.s, 2.0f * u.x - 1.0f, madd3(s.t, 2.0f * u.y - 1.0f, s.center));
    q.n = s.n;
    q.uv = u;
    q.area = 4.0f * wide_length3(cross3(s.s, s.t));
    return q;
}
