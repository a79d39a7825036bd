/* A point of a disk or ellipse as a light, evenly over its area [m]: see lights/emission.cl. */
SurfacePoint disk_point(Disk s, vec2 u)
{
    vec2 b = disk_of(u);
    SurfacePoint q;
    q.p = madd3(s.s, b.x, madd3(s.t, b.y, s.center));
    q.n = s.n;
    q.uv.x = sqrt_r(u.x);
    q.uv.y = u.y;
    q.area = 1.0f / disk_pdf_area(s);
    return q;
}
