/* A point of an open tube as a light, evenly over its area [m]: see lights/emission.cl. */
SurfacePoint cylinder_point(Cylinder s, vec2 u)
{
    real sine, cosine;
    sincos_2pi(u.x, &sine, &cosine);
    vec3 outward = madd3(s.x, cosine, scale3(s.y, sine));
    SurfacePoint q;
    q.p = madd3(outward, s.radius, madd3(s.axis, u.y, s.p0));
    q.n = scale3(outward, s.side);
    q.uv = u;
    q.area = 1.0f / cylinder_pdf_area(s);
    return q;
}
