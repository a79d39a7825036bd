/* Draine 2003: Henyey and Greenstein's density times (1 + alpha cos^2) / (1 + alpha (1 + 2 g^2) / 3). It is sampled by
 * the inverse of its integral, as Jendersie and d'Eon 2023 do in closed form; here by Newton's method, along the v of
 * Henyey and Greenstein's inverse: there the density is 1 + alpha cos^2 alone, and its integral v + alpha K(v), where
 * with y = (1 - g^2) / (1 + g - 2 g v), b = 1 + g^2 and cos = (b - y^2) / 2 g
 *
 *     K(v) = (1 - g^2) / 8 g^3 [b^2 (1 / y0 - 1 / y) - 2 b (y - y0) + (y^3 - y0^3) / 3],   y0 = 1 - g at v = 0.
 *
 * That loses digits where g is near 0: up to DRAINE_CLOSED, K is summed at six Gauss points, whose error is below
 * rounding there. */
#include "media/phase.cl"
#define DRAINE_CLOSED 0.25f
#define DRAINE_STEPS 24

inline real draine_density(real g, real alpha, real turn)
{
    real norm = 1.0f + alpha * (1.0f + 2.0f * g * g) * (1.0f / 3.0f);
    return hg_density(g, turn) * (1.0f + alpha * turn * turn) / norm;
}

/* The integral of cos^2 along v, from 0. */
inline real draine_squares(real g, real v)
{
    const float x[3] = {0.23861919f, 0.66120939f, 0.93246951f}, w[3] = {0.46791393f, 0.36076157f, 0.17132449f};
    real sum = (real)(0.0f);
    for (int i = 0; i < 3; i++)
        sum += w[i] * (sqr(hg_turn(g, v * 0.5f * (1.0f - x[i]))) + sqr(hg_turn(g, v * 0.5f * (1.0f + x[i]))));
    mask closed = fabs(g) > DRAINE_CLOSED;
    real h = sel(closed, g, (real)(0.5f)), b = 1.0f + h * h, y0 = 1.0f - h;
    real y = (1.0f - h * h) / (1.0f + h - 2.0f * h * v);
    real bracket = b * b * (1.0f / y0 - 1.0f / y) - 2.0f * b * (y - y0) + (y * y * y - y0 * y0 * y0) * (1.0f / 3.0f);
    return sel(closed, (1.0f - h * h) / (8.0f * h * h * h) * bracket, 0.5f * v * sum);
}

/* The cosine for a random number u. */
inline real draine_turn(real g, real alpha, real u)
{
    real goal = u * (1.0f + alpha * (1.0f + 2.0f * g * g) * (1.0f / 3.0f));
    real low = (real)(0.0f), high = (real)(1.0f), v = u;
    for (int i = 0; i < DRAINE_STEPS; i++) {
        real beyond = v + alpha * draine_squares(g, v) - goal;
        high = sel(beyond > 0.0f, v, high);
        low = sel(beyond > 0.0f, low, v);
        real next = v - beyond / (1.0f + alpha * sqr(hg_turn(g, v)));
        mask inside = (next > low) & (next < high), moved = fabs(next - v) > 1e-7f;
        v = sel(inside, next, sel(moved, 0.5f * (low + high), v));
        if (!any(moved)) break;
    }
    return hg_turn(g, v);
}

Spectrum draine_eval(Draine m, vec3 wo, vec3 wi)
{
    real turn = -dot3(wo, wi);
    Spectrum r;
#define C(c) r.c = draine_density(m.g.c, m.alpha.c, turn);
    SPECTRUM_EACH(C)
#undef C
    return r;
}

Spectrum draine_pdfs(Draine m, vec3 wo, vec3 wi) { return draine_eval(m, wo, wi); }

real draine_pdf(Draine m, vec3 wo, vec3 wi)
{
    return phase_pdf(draine_eval(m, wo, wi), phase_same(m.g) & phase_same(m.alpha));
}

BsdfSample draine_sample(Draine m, vec3 wo, vec3 u)
{
    mask same = phase_same(m.g) & phase_same(m.alpha);
    integer component = phase_component(same, &u.x);
    real turn = draine_turn(phase_part(m.g, component), phase_part(m.alpha, component), u.x);
    BsdfSample s = phase_turned(turn, u.y);
    return phase_weighed(s, draine_eval(m, wo, s.wi), same);
}

Spectrum draine_albedo(Draine m) { return spectrum_of(1.0f); }
