/* The pixel filter of light that arrives at a point of the film: one of the pixels whose filter holds the point gets
 * it, chosen by |f|, with the sum of |f| as its weight. So every pixel gets what the filter gives it, in the mean: as
 * by film/filter.cl, where a pixel's samples choose points. One axis after the other, as filters are separable.
 *
 * FILTER_BOX: f is the same in the radius, which `distributions` holds as film/filter.cl says. Else a table of f
 * follows the one that is told there: the radius, the number of steps n, and n + 1 values of f from 0 to the radius. */
#ifndef FILTER_BOX
/* f at a distance, 0 beyond the radius. */
inline real spread_filter(Scene scene, int table, real distance)
{
    float radius = scene.distributions[table], steps = scene.distributions[table + 1];
    real x = fabs(distance) * (steps / radius);
    mask inside = x < steps;
    integer i = to_integer(sel(inside, x, (real)(0.0f)));
    real a = gather(scene.distributions, i + (table + 2)), b = gather(scene.distributions, i + (table + 3));
    return sel(inside, a + (x - to_real(i)) * (b - a), (real)(0.0f));
}
#endif

/* The number of a pixel along an axis for the position p [pixels]. u: a number in [0, 1), which is used up in part and
 * is such a number again; weight: is multiplied by the filter's. */
inline integer spread_axis(Scene scene, real p, real *u, real *weight)
{
#ifdef FILTER_BOX
    float radius = scene.distributions[2];
    integer first = to_integer(ceil(p - (radius + 0.5f)));
    real count = floor(p + (radius - 0.5f)) - to_real(first) + 1.0f, x = *u * count, whole = floor(x);
    *u = x - whole;
    *weight *= count / (2.0f * radius);
    return sel_i(count > 0.0f, first + to_integer(whole), (integer)(-1));
#else
    int table = 2 * (int)scene.distributions[0] + 2, most = (int)(2.0f * scene.distributions[table]) + 2;
    integer first = to_integer(floor(p - scene.distributions[table])), chosen = first;
    real sum = 0.0f, before = 0.0f, share = 1.0f;
    for (int k = 0; k < most; k++) sum += fabs(spread_filter(scene, table, to_real(first + k) + 0.5f - p));
    real wanted = *u * sum, total = 0.0f, sign = 1.0f;
    for (int k = 0; k < most; k++) {
        real f = spread_filter(scene, table, to_real(first + k) + 0.5f - p), after = total + fabs(f);
        mask here = (f != 0.0f) & (total <= wanted);
        chosen = sel_i(here, first + k, chosen);
        before = sel(here, total, before);
        share = sel(here, fabs(f), share);
        sign = sel(here, sel(f < 0.0f, (real)(-1.0f), (real)(1.0f)), sign);
        total = after;
    }
    *u = clamp_r((wanted - before) / share, (real)(0.0f), (real)(0.999999f));
    *weight *= sum * sign;
    return chosen;
#endif
}
