/* Collisions near lamps: in thin media the light of a lamp is met where a ray passes it by, not where extinction alone
 * would let the ray collide. Some flights choose their distance so that all angles at an aim, a place that a lamp has,
 * are as likely (Kulla and Fajardo 2012, equiangular sampling). AIM_COUNT of them stand first in `media`, each as x,
 * y, z and the sum of the shares of those up to it.
 *
 * Any point is a valid aim, so a large lamp has one in its middle. Of `share` flights: half of them where little
 * lies between the ray and the aim, none where extinction hides it. */
#define MOST_AIMED 0.5f

typedef struct {
    real from, to; /* [m] */
    mask meets;    /* there is such a part */
} AimSpan; /* the part of a ray that a lamp may light */

#include "generated/aim_cone.cl"

typedef struct {
    real share;         /* of the flights that are chosen by angle */
    real delta, height; /* along the ray, and from it, to the aim [m] */
    real from, angle;   /* the angle where the lit part begins, and to its end [rad] */
    AimSpan lit;
} Equiangular;

/* The aim of a ray of a given extinction [1/m]; u chooses among them. */
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
