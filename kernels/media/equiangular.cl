/* Equiangular sampling (Kulla and Fajardo 2012): in thin media the light of a lamp is strong where a ray passes the
 * lamp, not where extinction alone makes the ray collide. Some flights choose their distance so that all angles at an
 * aim, a point of a lamp, are equally likely. AIM_COUNT aims stand first in `media`, each as x, y, z and the cumulative
 * share.
 *
 * Any point is a valid aim: a large lamp has its middle. `share` is half of the flights where little lies between
 * the ray and the aim, and falls with the transmittance to the aim. Both densities are combined by MIS (balance
 * heuristic). */
#define MOST_AIMED 0.5f

typedef struct {
    real from, to; /* [m] */
    mask meets;    /* the ray has such a part */
} AimSpan; /* the part of a ray that a lamp may light */

#include "generated/aim_cone.cl"

typedef struct {
    real share;         /* of flights with a distance by angle */
    real delta, height; /* along the ray, and from it, to the aim [m] */
    real from, angle;   /* the angle where the lit part begins, and to its end [rad] */
    AimSpan lit;
} Equiangular;

/* The aim of a ray in a medium of extinction sigma [1/m]; u chooses among the aims. */
inline Equiangular equiangular(Scene scene, vec3 o, vec3 d, real end, real sigma, real u)
{
    integer row = (integer)(0);
    for (int i = 0; i + 1 < AIM_COUNT; i++) {
        row = row + sel_i(u >= as_float(scene.media[4 * i + 3]), (integer)(4), (integer)(0));
    }
    vec4 aim = row4(scene.media, row);
    vec3 to = sub3(v3(aim.x, aim.y, aim.z), o);
    real far2 = dot3(to, to);
    Equiangular e;
    e.delta = dot3(to, d);
    e.height = sqrt_r(max_r(far2 - e.delta * e.delta, 1e-6f * far2 + 1e-12f));
    e.lit = aim_span(scene, row, d, to, e.delta, far2, end);
    e.from = atan2_r(e.lit.from - e.delta, e.height);
    e.angle = max_r(atan2_r(e.lit.to - e.delta, e.height) - e.from, (real)(1e-6f));
    e.share = sel(e.lit.meets, MOST_AIMED * exp_r(-sigma * sqrt_r(far2)), (real)(0.0f));
    return e;
}

inline real equiangular_distance(Equiangular e, real u)
{
    real s, c;
    sincos_2pi((e.from + u * e.angle) * (0.5f / PI) + 0.5f, &s, &c); /* both negated */
    return clamp_r(e.delta + e.height * s / min_r(c, (real)(-1e-7f)), e.lit.from, e.lit.to);
}

/* The density of a distance [1/m]. */
inline real equiangular_pdf(Equiangular e, real t)
{
    real x = t - e.delta;
    mask lit = (t >= e.lit.from) & (t <= e.lit.to);
    return sel(lit, e.height / (e.angle * (e.height * e.height + x * x)), (real)(0.0f));
}

typedef struct {
    Equiangular ends;
    mask aims;           /* the distance comes from an angle */
    real left, by_angle; /* share of other flights; the distance by angle [m] */
} FlightNear;

/* Chooses the flights by *u, which is rescaled to a new random number. */
inline FlightNear flight_near(Scene scene, Sampler sampler, integer vertex, integer name, vec3 o, vec3 d, real end,
                              Medium m, mask scatters, real *u)
{
    real choice = AIM_COUNT > 1 ? sampler_pair(sampler, as_natural(DIMENSION_AIM + vertex)).x : (real)(0.0f);
    FlightNear n;
    n.ends = equiangular(scene, o, d, end, spectrum_mean(m.sigma_t), choice);
    n.ends.share = flight_near_share(name, n.ends.share);
    n.aims = scatters & (*u < n.ends.share);
    n.left = 1.0f - n.ends.share;
    n.by_angle = equiangular_distance(n.ends, *u / max_r(n.ends.share, (real)(1e-9f)));
    *u = max_r(*u - n.ends.share, (real)(0.0f)) / n.left;
    return n;
}
inline real flight_near_end(FlightNear n, real t) { return sel(n.aims, n.by_angle, t); }
inline Spectrum flight_near_pdf(FlightNear n, real t, mask collides, Spectrum pdf)
{
    real nearby = sel(collides, n.ends.share * equiangular_pdf(n.ends, t), (real)(0.0f));
    return spectrum_add(spectrum_scale(pdf, n.left), spectrum_of(nearby));
}

/* Twin, where no homogeneous medium holds a lamp, and for light paths: distances are sampled by transmittance alone. */
typedef struct { mask aims; } FlightNear;
inline FlightNear flight_near(Scene scene, Sampler sampler, integer vertex, integer name, vec3 o, vec3 d, real end,
                              Medium m, mask scatters, real *u) { FlightNear n = {mask_of(0)}; return n; }
inline real flight_near_end(FlightNear n, real t) { return t; }
inline Spectrum flight_near_pdf(FlightNear n, real t, mask collides, Spectrum pdf) { return pdf; }

/* Step cone: aims of lamps that shine into a cone: flights aim at such a lamp only where its light goes. Behind the
 * aims in `media` follow as many cones: x, y, z of the axis, and the cosine of the half angle, -1 for no cone. */
#define AIM_COUNT (MEDIUM_AIMS / 2)

/* The part of a ray in the cone of the aim in `row`. to: the aim as seen from the ray's origin; delta: its component
 * along d; far2: its squared length; end: of the ray [m]. */
inline AimSpan aim_span(Scene scene, integer row, vec3 d, vec3 to, real delta, real far2, real end)
{
    vec4 cone = row4(scene.media, row + 4 * AIM_COUNT);
    vec3 axis = v3(cone.x, cone.y, cone.z);
    real along = dot3(axis, d), from = -dot3(axis, to), c2 = cone.w * cone.w;
    /* a t^2 + 2 b t + c is above 0 in the cone, and in its mirror image behind the apex */
    real a = along * along - c2, b = from * along + c2 * delta, c = from * from - c2 * far2;
    real square = b * b - a * c, root = sqrt_r(max_r(square, (real)(0.0f)));
    real q = -(b + sel(b < 0.0f, -root, root));
    real one = q / sel(fabs(a) > 1e-12f, a, (real)(1e-12f)), two = c / sel(fabs(q) > 1e-20f, q, (real)(1e-20f));
    real low = min_r(one, two), high = max_r(one, two);
    mask beyond = a > 0.0f, ahead = along > 0.0f; /* a ray that is steeper than the cone enters or leaves it once */
    mask misses = !beyond & ((square <= 0.0f) | (from + 0.5f * (low + high) * along <= 0.0f));
    AimSpan s;
    s.from = max_r(sel(beyond, sel(ahead, high, (real)(0.0f)), low), (real)(0.0f));
    s.to = min_r(sel(beyond & ahead, end, sel(beyond, low, high)), end);
    mask none = cone.w < 0.0f;
    s.from = sel(none, (real)(0.0f), min_r(s.from, end));
    s.to = sel(none, end, max_r(s.to, s.from));
    s.meets = none | (!misses & (s.to > s.from));
    return s;
}

/* Twin, where no lamp near which flights end shines into a cone. */
#define AIM_COUNT MEDIUM_AIMS

inline AimSpan aim_span(Scene scene, integer row, vec3 d, vec3 to, real delta, real far2, real end)
{
    return (AimSpan){(real)(0.0f), end, mask_of(1)};
}
