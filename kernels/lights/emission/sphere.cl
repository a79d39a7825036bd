/* A point of a sphere as a light, evenly over its area [m]: see lights/emission.cl. */
SurfacePoint sphere_point(Sphere s, vec2 u)
{
    vec3 outward = uniform_sphere(u);
    SurfacePoint q;
    q.p = madd3(outward, s.radius, s.center);
    q.n = scale3(outward, s.side);
    q.uv = sphere_uv(s, outward);
    q.area = 4.0f * PI * s.radius * s.radius;
    return q;
}
