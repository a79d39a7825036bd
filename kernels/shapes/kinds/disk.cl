/* A disk, or an ellipse where its transform stretches it; sampled evenly over its area. u is the
 * distance from the centre (1 at the rim), v the azimuth over 2 pi. */
#include "core/rounding.cl"

inline real disk_reach(Disk q) { return size3(q.s) + size3(q.t); }
real disk_size(Disk q) { return EXACT_SIZE * (disk_reach(q) + size3(q.center)); }

inline real disk_pdf_area(Disk q) { return INV_PI / wide_length3(cross3(q.s, q.t)); }

ShapeSample disk_sample(Disk q, vec3 p, vec2 u)
{
    vec2 b = disk_of(u);
    vec3 to = sub3(madd3(q.s, b.x, madd3(q.t, b.y, q.center)), p);
    ShapeSample r;
    r.t = sqrt(max_r(dot3(to, to), (real)(1e-20f)));
    r.wi = scale3(to, 1.0f / r.t);
    r.n = q.n;
    r.uv.x = sqrt_r(u.x);
    r.uv.y = u.y;
    r.size = disk_reach(q);
    r.pdf = solid_angle_pdf(disk_pdf_area(q), r.t, fabs(dot3(q.n, r.wi)));
    return r;
}

real disk_pdf(Disk q, vec3 p, vec3 wi, real t, vec3 n)
{
    return solid_angle_pdf(disk_pdf_area(q), t, fabs(dot3(q.n, wi)));
}

/* An origin that is closer to the plane than its coordinates can tell does not meet the disk. */
ShapeHit disk_intersect(Disk q, vec3 o, vec3 d, real tmin, real tmax)
{
    real scale = scale_to_one(disk_reach(q)); /* so that products of four lengths stay inside a float */
    Twofold3 way = twofold_sub3(q.center, o);
    vec3 to = way.high, s = scale3(q.s, scale), along = scale3(q.t, scale), c = cross3(s, along);
    Twofold3 along_ray = {d, v3(0.0f, 0.0f, 0.0f)};
    real height = twofold_real(twofold_dot3(way, q.n)), slope = twofold_real(twofold_dot3(along_ray, q.n));
    real t = safe_div(height, slope);
    vec3 at = scale3(sub3(scale3(d, t), to), scale);
    real inverse = 1.0f / max_r(dot3(c, c), (real)(1e-37f));
    real x = dot3(at, cross3(along, c)) * inverse, y = dot3(at, cross3(c, s)) * inverse;
    real radius2 = x * x + y * y;
    mask met = (slope != 0.0f) & (radius2 <= 1.0f) & (t > tmin) & (t < tmax)
             & (fabs(height) > beside_step(o, disk_size(q) + EXACT_SIZE * size3(to)));
    ShapeHit h;
    h.t = sel(met, t, (real)(FAR));
    h.n = q.n;
    h.uv.x = sqrt(radius2);
    h.uv.y = turn_of(y, x);
    return h;
}

vec3 disk_onto(Disk q, vec3 p)
{
    return madd3(q.n, twofold_real(twofold_dot3(twofold_sub3(q.center, p), q.n)), p);
}

vec3 disk_dpdu(Disk q, vec3 p, vec2 uv) /* along the radius */
{
    real s, c;
    sincos_2pi(uv.y, &s, &c);
    return madd3(q.s, c, scale3(q.t, s));
}

vec3 disk_dpdv(Disk q, vec3 p, vec2 uv) /* around the centre */
{
    real s, c, around = 2.0f * PI * uv.x;
    sincos_2pi(uv.y, &s, &c);
    return add3(scale3(q.s, -around * s), scale3(q.t, around * c));
}

/* Step emission: a point of a disk or ellipse as a light, evenly over its area [m]: see lights/emission.cl. */
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
