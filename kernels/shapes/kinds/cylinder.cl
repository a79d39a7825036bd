/* An open tube; sampled evenly over its area. u is the azimuth over 2 pi, v runs along the axis. */
#include "core/rounding.cl"

real cylinder_size(Cylinder q) { return EXACT_SIZE * (q.radius + size3(q.axis) + size3(q.p0)); }

/* The square of the distance (x, y) from the axis, minus the square of the radius. */
inline Twofold cylinder_beyond(Cylinder q, Twofold x, Twofold y)
{
    Twofold square = twofold_add(twofold_sqr(x), twofold_sqr(y));
    return twofold_add(square, twofold_neg(twofold_product(q.radius, q.radius)));
}

inline real cylinder_pdf_area(Cylinder q)
{
    return INV_2PI / max_r(q.radius * sqrt(dot3(q.axis, q.axis)), (real)(1e-37f));
}

ShapeSample cylinder_sample(Cylinder q, vec3 p, vec2 u)
{
    real s, c;
    sincos_2pi(u.x, &s, &c);
    vec3 outward = madd3(q.x, c, scale3(q.y, s));
    vec3 to = sub3(madd3(outward, q.radius, madd3(q.axis, u.y, q.p0)), p);
    ShapeSample r;
    r.t = sqrt(max_r(dot3(to, to), (real)(1e-20f)));
    r.wi = scale3(to, 1.0f / r.t);
    r.n = scale3(outward, q.side);
    r.uv = u;
    r.size = q.radius + size3(q.axis);
    r.pdf = solid_angle_pdf(cylinder_pdf_area(q), r.t, fabs(dot3(outward, r.wi)));
    return r;
}

real cylinder_pdf(Cylinder q, vec3 p, vec3 wi, real t, vec3 n)
{
    return solid_angle_pdf(cylinder_pdf_area(q), t, fabs(dot3(n, wi)));
}

/* As a sphere (see there), in the plane across the axis; both walls are tried. */
ShapeHit cylinder_intersect(Cylinder q, vec3 o, vec3 d, real tmin, real tmax)
{
    Twofold3 f = twofold_sub3(o, q.p0);
    Twofold x2 = twofold_dot3(f, q.x), y2 = twofold_dot3(f, q.y), beyond = cylinder_beyond(q, x2, y2);
    real fx = x2.high, fy = y2.high, dx = dot3(d, q.x), dy = dot3(d, q.y);
    real a = dx * dx + dy * dy, over_a = 1.0f / max_r(a, (real)(1e-20f));
    real b = -(fx * dx + fy * dy) * over_a, square = q.radius * q.radius, c = twofold_real(beyond);
    real lx = fx + b * dx, ly = fy + b * dy;
    real disc = sel(fabs(c) < square, b * b - c * over_a, (square - lx * lx - ly * ly) * over_a), s = sqrt_r(disc);
    real rounding = beside_step(o, cylinder_size(q) + EXACT_SIZE * size3(f.high));
    c = sel(fabs(c) < 2.0f * q.radius * rounding, (real)(0.0f), c * over_a);
    real far = b + sel(b < 0.0f, -s, s), near = safe_div(c, far);
    real lo = min_r(near, far), hi = max_r(near, far);
    real along = 1.0f / dot3(q.axis, q.axis), v0 = dot3(f.high, q.axis) * along, dv = dot3(d, q.axis) * along;
    real v_lo = v0 + lo * dv, v_hi = v0 + hi * dv;
    mask first = (lo > tmin) & (v_lo >= 0.0f) & (v_lo <= 1.0f);
    real t = sel(first, lo, hi), v = sel(first, v_lo, v_hi), step = sel(first, -s, s);
    mask met = (a > 1e-20f) & (disc >= 0.0f) & (t > tmin) & (t < tmax) & (v >= 0.0f) & (v <= 1.0f);
    real x = lx + step * dx, y = ly + step * dy;
    ShapeHit h;
    h.t = sel(met, t, (real)(FAR));
    h.n = scale3(normalize3(madd3(q.x, x, scale3(q.y, y))), q.side);
    h.uv.x = turn_of(y, x);
    h.uv.y = v;
    return h;
}

vec3 cylinder_onto(Cylinder q, vec3 p)
{
    Twofold3 f = twofold_sub3(p, q.p0);
    Twofold x = twofold_dot3(f, q.x), y = twofold_dot3(f, q.y);
    real length = sqrt(max_r(x.high * x.high + y.high * y.high, (real)(1e-35f)));
    real height = twofold_real(cylinder_beyond(q, x, y)) / (length + q.radius);
    return madd3(add3(scale3(q.x, x.high), scale3(q.y, y.high)), -height / length, p);
}

vec3 cylinder_dpdu(Cylinder q, vec3 p, vec2 uv)
{
    real s, c, around = 2.0f * PI * q.radius;
    sincos_2pi(uv.x, &s, &c);
    return add3(scale3(q.x, -around * s), scale3(q.y, around * c));
}

vec3 cylinder_dpdv(Cylinder q, vec3 p, vec2 uv) { return q.axis; }

/* Step emission: a point of an open tube as a light, evenly over its area [m]: see lights/emission.cl. */
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
