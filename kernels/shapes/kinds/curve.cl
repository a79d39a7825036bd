/* A piece of a strand: the union of spheres with centre c(s) and radius r(s), both cubics, s from 0 to 1. A ray
 * o + t d meets the sphere at s where t = z -+ sqrt(D), with D = r^2 - x^2 - y^2 and x, y, z the centre across and
 * along the ray. The surface is met at the least (or greatest) t: where
 *     F(s) = +-z' sqrt(D) - D' / 2 = 0,
 * which also means that the normal leans by r' against the curve. F is negative before the zero and positive behind
 * it, and where the ray misses the spheres the zero is at the greatest D; so the zero lies between the ends of the
 * piece, or the piece is not met.
 * A step takes the curve as straight and the radius as linear near s, where the zero has a closed form: exact for
 * straight pieces, else the next estimate; a bisection replaces a step that leaves the bounds. (That local cones
 * converge fast: Reshetov and Luebke
 * 2018, "Phantom Ray-Hair Intersector".) u is the azimuth over 2 pi, v runs along. Lengths in metres. */
#include "core/rounding.cl"
#define CURVE_STEPS 24
#define CURVE_NEAR 2e-4f    /* of a piece: a smaller step is the last; the error that remains is far smaller */
#define CURVE_OVERLAP 2e-3f /* [rad] overlap of a piece beyond its end, so that no ray passes between two pieces */

typedef struct { real a, b, c, d; } Cubic; /* a + b s + c s^2 + d s^3 */
inline Cubic cubic_of(real p0, real p1, real p2, real p3)
{
    return (Cubic){p0, 3.0f * (p1 - p0), 3.0f * ((p2 - p1) - (p1 - p0)), (p3 - p0) - 3.0f * (p2 - p1)};
}
inline real cubic_at(Cubic q, real s) { return q.a + s * (q.b + s * (q.c + s * q.d)); }
inline real cubic_slope(Cubic q, real s) { return q.b + s * (2.0f * q.c + s * (3.0f * q.d)); }
inline real cubic_bend(Cubic q, real s) { return 2.0f * q.c + s * (6.0f * q.d); }
inline vec3 curve_point(vec3 p0, vec3 p1, vec3 p2, vec3 p3, real s)
{
    real t = 1.0f - s;
    return madd3(p0, t * t * t, madd3(p1, 3.0f * t * t * s, madd3(p2, 3.0f * t * s * s, scale3(p3, s * s * s))));
}
inline vec3 curve_slope(Curve q, real s)
{
    real t = 1.0f - s;
    return scale3(madd3(sub3(q.p1, q.p0), t * t, madd3(sub3(q.p2, q.p1), 2.0f * t * s,
                  scale3(sub3(q.p3, q.p2), s * s))), 3.0f);
}
inline vec3 curve_bend(Curve q, real s)
{
    vec3 a = add3(sub3(q.p0, scale3(q.p1, 2.0f)), q.p2), b = add3(sub3(q.p1, scale3(q.p2, 2.0f)), q.p3);
    return scale3(madd3(a, 1.0f - s, scale3(b, s)), 6.0f);
}

/* A slope at unit length; where the curve stands still, its chord. */
inline vec3 curve_tangent(vec3 slope, vec3 chord)
{
    vec3 v = sel3(dot3(slope, slope) > 0.0f, slope, chord);
    return scale3(v, 1.0f / sqrt(max_r(dot3(v, v), (real)(1e-37f))));
}

inline real curve_reach(Curve q) { return max_r(max_r(fabs(q.r0), q.r1), max_r(q.r2, fabs(q.r3))); }
inline real least4(real a, real b, real c, real d) { return min_r(min_r(a, b), min_r(c, d)); }
inline real most4(real a, real b, real c, real d) { return max_r(max_r(a, b), max_r(c, d)); }

/* A piece as a ray sees it, and the state of the search at s. */
typedef struct { real x, y, r, dx, dy, dz, dr; } CurveEnd;
typedef struct { Cubic x, y, z, r; CurveEnd first, last; } CurveView;
typedef struct { real square, half_slope, bend, along, f; } CurveState; /* D, D'/2, -D''/2, -+z', F */
inline CurveState curve_state(CurveView c, real side, real s)
{
    real x = cubic_at(c.x, s), y = cubic_at(c.y, s), r = cubic_at(c.r, s);
    real dx = cubic_slope(c.x, s), dy = cubic_slope(c.y, s), dz = cubic_slope(c.z, s), dr = cubic_slope(c.r, s);
    CurveState n;
    real across = dx * dx + dy * dy;
    n.square = (r - x) * (r + x) - y * y;
    n.half_slope = r * dr - x * dx - y * dy;
    n.bend = across - dr * dr + x * cubic_bend(c.x, s) + y * cubic_bend(c.y, s) - r * cubic_bend(c.r, s);
    n.along = -side * dz;
    n.f = n.along * sqrt_r(n.square) - n.half_slope;
    n.bend = max_r(n.bend, 0.1f * across + 1e-6f * dz * dz + 1e-30f);
    return n;
}

/* F at an end, and the square of its tolerance. */
inline real curve_end(CurveEnd e, real side, real *over)
{
    *over = sqr(CURVE_OVERLAP * e.r) * (e.dx * e.dx + e.dy * e.dy + e.dz * e.dz);
    return -side * e.dz * sqrt_r((e.r - e.x) * (e.r + e.x) - e.y * e.y) - (e.r * e.dr - e.x * e.dx - e.y * e.dy);
}

/* Finds where the surface is met, on the near (-1) or far (1) side; returns the lanes that meet it. */
inline mask curve_find(CurveView c, real side, mask closed0, mask closed1, mask active, real *at)
{
    real over0, over1, first = curve_end(c.first, side, &over0), last = curve_end(c.last, side, &over1);
    mask before = first > 0.0f, behind = !before & (last < 0.0f);
    mask here = active & (!before | closed0 | (first * first <= over0)) & (!behind | closed1 | (last * last <= over1));
    real s = sel(before, (real)(0.0f), sel(behind, (real)(1.0f), (real)(0.5f)));
    *at = s;
    if (!any(here)) return here;
    real low = 0.0f, high = 1.0f;
    mask seeks = here & !before & !behind;
    for (int i = 0; i < CURVE_STEPS && any(seeks); i++) {
        CurveState n = curve_state(c, side, s);
        low = sel(seeks & (n.f < 0.0f), s, low);
        high = sel(seeks & (n.f >= 0.0f), s, high);
        real depth = max_r(n.square * n.bend + n.half_slope * n.half_slope, (real)(0.0f));
        real step = n.half_slope - n.along * sqrt(depth / (n.bend + n.along * n.along));
        real next = s + step / n.bend;
        next = sel((next >= low) & (next <= high), next, 0.5f * (low + high));
        step = fabs(next - s);
        s = sel(seeks, next, s);
        seeks = seeks & (step > CURVE_NEAR);
    }
    *at = s;
    real x = cubic_at(c.x, s), y = cubic_at(c.y, s), r = cubic_at(c.r, s);
    return here & ((r - x) * (r + x) >= y * y);
}

real curve_size(Curve q) { return 2.0f * curve_reach(q) + size3(sub3(q.p3, q.p0)); }

ShapeHit curve_intersect(Curve q, vec3 o, vec3 d, real tmin, real tmax)
{
    ShapeHit h;
    h.t = FAR;
    h.n = v3(0.0f, 0.0f, 1.0f);
    h.uv.x = 0.0f;
    h.uv.y = 0.0f;
    /* Relative to the point of the ray beside the piece, so that rounding stays small. */
    real reach = curve_reach(q);
    real shift = 0.5f * (dot3(sub3(q.p0, o), d) + dot3(sub3(q.p3, o), d));
    vec3 from = madd3(d, shift, o);
    vec3 f0 = sub3(q.p0, from), f1 = sub3(q.p1, from), f2 = sub3(q.p2, from), f3 = sub3(q.p3, from);
    real z0 = dot3(f0, d), z1 = dot3(f1, d), z2 = dot3(f2, d), z3 = dot3(f3, d);
    real nearest = shift + least4(z0, z1, z2, z3) - reach;
    mask alive = (nearest < tmax) & (shift + most4(z0, z1, z2, z3) + reach > tmin);
    vec3 chord = sub3(f3, f0), across = cross3(chord, d);
    real size2 = dot3(across, across);
    /* The ray passes all control points on a single side: an early exit for most pieces whose boxes are met. */
    real w0 = dot3(f0, across), w1 = dot3(f1, across), w2 = dot3(f2, across), w3 = dot3(f3, across);
    real beside = max_r(max_r(least4(w0, w1, w2, w3), -most4(w0, w1, w2, w3)), (real)(0.0f));
    alive = alive & (beside * beside <= reach * reach * size2);
    if (!any(alive)) return h;
    mask skew = size2 > 1e-10f * dot3(chord, chord);
    vec3 ex = scale3(across, 1.0f / sqrt(sel(skew, size2, (real)(1.0f))));
    if (any(!skew)) ex = sel3(skew, ex, frame_of(d).s);
    real x0 = dot3(f0, ex), x1 = dot3(f1, ex), x2 = dot3(f2, ex), x3 = dot3(f3, ex);
    vec3 ey = cross3(d, ex);
    real y0 = dot3(f0, ey), y1 = dot3(f1, ey), y2 = dot3(f2, ey), y3 = dot3(f3, ey);
    alive = alive & (least4(y0, y1, y2, y3) <= reach) & (most4(y0, y1, y2, y3) >= -reach);
    if (!any(alive)) return h;
    real r0 = fabs(q.r0), r3 = fabs(q.r3);
    CurveView c = {cubic_of(x0, x1, x2, x3), cubic_of(y0, y1, y2, y3), cubic_of(z0, z1, z2, z3),
                   cubic_of(r0, q.r1, q.r2, r3),
                   {x0, y0, r0, x1 - x0, y1 - y0, z1 - z0, q.r1 - r0},
                   {x3, y3, r3, x3 - x2, y3 - y2, z3 - z2, r3 - q.r2}};
    mask closed0 = q.r0 < 0.0f, closed1 = q.r3 < 0.0f;
    real s = 0.0f, side = -1.0f, t = FAR, far_s;
    mask met = curve_find(c, side, closed0, closed1, alive, &s);
    CurveState n = curve_state(c, side, s);
    t = shift + cubic_at(c.z, s) - sqrt_r(n.square);
    met = met & (t > tmin) & (t < tmax);
    mask inside = alive & !met & (nearest <= tmin); /* it may begin within */
    if (any(inside)) {
        mask leaves = curve_find(c, (real)(1.0f), closed0, closed1, inside, &far_s);
        CurveState m = curve_state(c, (real)(1.0f), far_s);
        real far_t = shift + cubic_at(c.z, far_s) + sqrt_r(m.square);
        leaves = leaves & (far_t > tmin) & (far_t < tmax);
        s = sel(leaves, far_s, s);
        side = sel(leaves, (real)(1.0f), side);
        t = sel(leaves, far_t, t);
        n.square = sel(leaves, m.square, n.square);
        met = met | leaves;
    }
    h.t = sel(met, t, (real)(FAR));
    vec3 out = madd3(d, side * sqrt_r(n.square), madd3(ex, -cubic_at(c.x, s), scale3(ey, -cubic_at(c.y, s))));
    out = normalize3(out);
    h.n = scale3(out, q.side);
    h.uv.y = q.v + s * q.dv;

    vec3 begin = curve_tangent(curve_slope(q, (real)(0.0f)), chord), slope = curve_tangent(curve_slope(q, s), chord);
    /* The axis at the beginning, rotated as the tangent is. */
    real turn = dot3(q.axis, slope) / max_r(1.0f + dot3(begin, slope), (real)(1e-6f));
    vec3 e = madd3(add3(begin, slope), -turn, q.axis);
    h.uv.x = turn_of(dot3(out, cross3(slope, e)), dot3(out, e));
    return h;
}

/* The parameter of the sphere that touches the surface at p, for p close to it. */
inline real curve_foot(Curve q, vec3 p)
{
    vec3 chord = sub3(q.p3, q.p0);
    real s = dot3(sub3(p, q.p0), chord) / max_r(dot3(chord, chord), (real)(1e-37f));
    Cubic r = cubic_of(fabs(q.r0), q.r1, q.r2, fabs(q.r3));
    s = clamp_r(s, (real)(0.0f), (real)(1.0f));
    for (int i = 0; i < 5; i++) {
        vec3 f = sub3(p, curve_point(q.p0, q.p1, q.p2, q.p3, s)), slope = curve_slope(q, s);
        real dr = cubic_slope(r, s), speed2 = dot3(slope, slope);
        real g = dot3(f, slope) + cubic_at(r, s) * dr;
        real falls = speed2 - dot3(f, curve_bend(q, s)) - dr * dr - cubic_at(r, s) * cubic_bend(r, s);
        s = clamp_r(s + g / max_r(falls, 0.1f * speed2 + 1e-37f), (real)(0.0f), (real)(1.0f));
    }
    return s;
}

vec3 curve_onto(Curve q, vec3 p)
{
    real s = curve_foot(q, p), radius = cubic_at(cubic_of(fabs(q.r0), q.r1, q.r2, fabs(q.r3)), s);
    vec3 c = curve_point(q.p0, q.p1, q.p2, q.p3, s);
    return madd3(normalize3(sub3(p, c)), radius, c);
}

vec3 curve_dpdu(Curve q, vec3 p, vec2 uv)
{
    real s = curve_foot(q, p);
    vec3 slope = curve_slope(q, s), f = sub3(p, curve_point(q.p0, q.p1, q.p2, q.p3, s));
    real inverse = 1.0f / sqrt(max_r(dot3(slope, slope), (real)(1e-37f)));
    return scale3(cross3(slope, f), 2.0f * PI * inverse);
}

vec3 curve_dpdv(Curve q, vec3 p, vec2 uv)
{
    return scale3(curve_slope(q, curve_foot(q, p)), 1.0f / max_r(q.dv, (real)(1e-37f)));
}
