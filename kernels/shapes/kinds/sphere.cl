/* A sphere. As a light it is sampled evenly over the cone that it subtends from outside, and evenly over its area from
 * inside. u is the azimuth about its z axis over 2 pi, v the angle from it over pi. */
#include "core/rounding.cl"

#define SPHERE_ROUNDING 1e-5f /* of a distance to the centre, many times what floats round */

real sphere_size(Sphere q) { return EXACT_SIZE * (q.radius + size3(q.center)); }

/* The square of the distance `f` from the centre, minus the square of the radius. */
inline Twofold sphere_beyond(Sphere q, Twofold3 f)
{
    return twofold_add(twofold_square3(f), twofold_neg(twofold_product(q.radius, q.radius)));
}

inline vec2 sphere_uv(Sphere q, vec3 outward)
{
    real x = dot3(outward, q.x), y = dot3(outward, q.y), z = dot3(outward, q.z);
    vec2 uv;
    uv.x = turn_of(y, x);
    uv.y = atan2_r(sqrt(x * x + y * y), z) * INV_PI;
    return uv;
}

/* Whether a point at distance d from the centre is outside. A point on the surface is not, though rounding may put it
 * there: it would sample no light, while a ray from its offset inside meets the whole sphere. */
inline mask sphere_outside(Sphere q, real d)
{
    return d > q.radius + 2.0f * SURFACE_ROUNDING * (size3(q.center) + 2.0f * q.radius);
}

/* sin^2 of the cone's half angle from a distance d > radius, and 1 - cos without cancellation. */
inline real sphere_cone(Sphere q, real d, real *sin2)
{
    *sin2 = sqr(q.radius / d);
    return *sin2 / (1.0f + sqrt_r((d - q.radius) * (d + q.radius)) / d);
}

ShapeSample sphere_sample(Sphere q, vec3 p, vec2 u)
{
    vec3 to = sub3(q.center, p);
    real d = sqrt(max_r(dot3(to, to), (real)(1e-30f))), sin2_max;
    mask outside = sphere_outside(q, d);

    /* From inside. */
    vec3 outward = uniform_sphere(u), there = madd3(outward, q.radius, to);
    real t = sqrt(max_r(dot3(there, there), (real)(1e-20f)));
    ShapeSample r;
    r.t = t;
    r.wi = scale3(there, 1.0f / t);
    real pdf = solid_angle_pdf(INV_4PI / sqr(q.radius), t, fabs(dot3(outward, r.wi)));
    r.pdf = pdf;

    if (any(outside)) { /* The nearer of the two points along a direction in the cone (pbrt-v4 6.2.4). */
        Frame f = frame_of(scale3(to, 1.0f / d));
        real one_minus_cos = sphere_cone(q, sel(outside, d, 2.0f * q.radius), &sin2_max);
        vec3 w = uniform_cone(u, one_minus_cos);
        real sin2 = w.x * w.x + w.y * w.y, depth = sqrt_r(1.0f - sin2 / sin2_max);
        real near = (d - q.radius) * (d + q.radius) / max_r(d * w.z + q.radius * depth, (real)(1e-30f));
        real across = near / q.radius;
        vec3 normal = v3(w.x * across, w.y * across, -(sin2 / sqrt(sin2_max) + w.z * depth));
        r.t = sel(outside, near, r.t);
        r.wi = sel3(outside, to_world(f, w), r.wi);
        outward = sel3(outside, normalize3(to_world(f, normal)), outward);
        r.pdf = sel(outside, INV_2PI / one_minus_cos, pdf);
    }
    r.n = scale3(outward, q.side);
    r.uv = sphere_uv(q, outward);
    r.size = q.radius;
    return r;
}

real sphere_pdf(Sphere q, vec3 p, vec3 wi, real t, vec3 n)
{
    vec3 to = sub3(q.center, p);
    real d = sqrt(max_r(dot3(to, to), (real)(1e-30f))), sin2;
    mask outside = sphere_outside(q, d);
    real one_minus_cos = sphere_cone(q, sel(outside, d, 2.0f * q.radius), &sin2);
    real inside = solid_angle_pdf(INV_4PI / sqr(q.radius), t, fabs(dot3(n, wi)));
    return sel(outside, INV_2PI / one_minus_cos, inside);
}

/* Whether a ray from `f`, counted from the centre, may meet the sphere, whatever floats round. */
inline mask sphere_is_near(Sphere q, vec3 f, vec3 d, real tmin, real tmax)
{
    real b = -dot3(f, d), reach = q.radius + SPHERE_ROUNDING * (q.radius + size3(q.center) + size3(f));
    vec3 l = madd3(d, b, f);
    return (dot3(l, l) <= reach * reach) & (b + reach >= tmin) & (b - reach <= tmax);
}

/* The discriminant from the ray's distance to the centre (Haines et al. 2019, Ray Tracing Gems, 7); from the height
 * over the surface where that is no more than the radius. An origin that is closer to the surface than its coordinates
 * can tell lies on it. */
ShapeHit sphere_intersect(Sphere q, vec3 o, vec3 d, real tmin, real tmax)
{
    ShapeHit h = {(real)(FAR), v3(0.0f, 0.0f, 0.0f), (vec2){(real)(0.0f), (real)(0.0f)}};
    Twofold3 f = twofold_sub3(o, q.center);
    if (!any(sphere_is_near(q, f.high, d, tmin, tmax))) return h;
    Twofold beyond = sphere_beyond(q, f);
    real b = -twofold_real(twofold_dot3(f, d)), c = twofold_real(beyond), square = q.radius * q.radius;
    vec3 l = madd3(d, b, f.high);
    real disc = sel(fabs(c) < square, twofold_real(twofold_add(twofold_product(b, b), twofold_neg(beyond))),
                    square - dot3(l, l));
    real s = sqrt_r(disc);
    c = sel(fabs(c) < 2.0f * q.radius * beside_step(o, sphere_size(q)), (real)(0.0f), c);
    real far = b + sel(b < 0.0f, -s, s), near = safe_div(c, far);
    real lo = min_r(near, far), hi = max_r(near, far);
    mask first = lo > tmin;
    real t = sel(first, lo, hi);
    mask met = (disc >= 0.0f) & (t > tmin) & (t < tmax);
    vec3 outward = normalize3(madd3(d, sel(first, -s, s), l));
    h.t = sel(met, t, (real)(FAR));
    h.n = scale3(outward, q.side);
    h.uv = sphere_uv(q, outward);
    return h;
}

vec3 sphere_onto(Sphere q, vec3 p)
{
    Twofold3 f = twofold_sub3(p, q.center);
    real length = sqrt(max_r(dot3(f.high, f.high), (real)(1e-35f)));
    real height = twofold_real(sphere_beyond(q, f)) / (length + q.radius);
    return madd3(f.high, -height / length, p);
}

vec3 sphere_dpdu(Sphere q, vec3 p, vec2 uv)
{
    vec3 f = sub3(p, q.center);
    return add3(scale3(q.x, -2.0f * PI * dot3(f, q.y)), scale3(q.y, 2.0f * PI * dot3(f, q.x)));
}

/* v is the polar angle from z over pi; zero at the poles. */
vec3 sphere_dpdv(Sphere q, vec3 p, vec2 uv)
{
    vec3 f = sub3(p, q.center);
    real x = dot3(f, q.x), y = dot3(f, q.y), z = dot3(f, q.z), r2 = x * x + y * y;
    real inv = PI / sqrt(max_r(r2, (real)(1e-20f)));
    return madd3(q.x, x * z * inv, madd3(q.y, y * z * inv, scale3(q.z, -r2 * inv)));
}

/* Step emission: a point of a sphere as a light, evenly over its area [m]: see lights/emission.cl. */
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
