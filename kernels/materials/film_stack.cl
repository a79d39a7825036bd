/* A stack of thin films between two media: Fresnel's amplitudes at each boundary, and the endless
 * reflections between the boundaries summed as a geometric series, from the base upward (Airy 1833;
 * Rouard 1937; Parratt 1954). Nothing in it grows with an absorbing film, so that it is stable.
 *
 * An index is n + i k, a wave exp(i (q z - omega t)) with q = n cos [in units of the vacuum's wave
 * number]; 2 pi q thickness / wavelength is its phase. Born and Wolf 1999, 1.6.4 and 14.4. With Y = q
 * for s- and Y = q / n^2 for p-polarised light, a boundary's amplitude is (Y - Y') / (Y + Y'). */
typedef struct { real re, im; } Complex;

inline Complex complex_of(real re, real im) { Complex r = {re, im}; return r; }
inline Complex complex_add(Complex a, Complex b) { return complex_of(a.re + b.re, a.im + b.im); }
inline Complex complex_sub(Complex a, Complex b) { return complex_of(a.re - b.re, a.im - b.im); }
inline Complex complex_mul(Complex a, Complex b)
{
    return complex_of(a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re);
}
inline real complex_norm(Complex a) { return a.re * a.re + a.im * a.im; } /* |a|^2 */
inline Complex complex_div(Complex a, Complex b)
{
    real inv = 1.0f / max_r(complex_norm(b), (real)(1e-30f));
    return complex_of((a.re * b.re + a.im * b.im) * inv, (a.im * b.re - a.re * b.im) * inv);
}
/* The root with re, im >= 0 of a number with im >= 0: a wave that goes on, or dies away. */
inline Complex complex_sqrt(Complex a)
{
    real large = sqrt(0.5f * (sqrt(complex_norm(a)) + fabs(a.re)));
    real small = 0.5f * a.im / max_r(large, (real)(1e-15f));
    return complex_of(sel(a.re < 0.0f, small, large), sel(a.re < 0.0f, large, small));
}

/* What a medium is to a wave of given direction: its admittance Y of both polarisations; q is that of s. */
typedef struct { Complex s, p; } Admittance;

/* Medium of index eta + i k; the wave came in at cosine c from a medium of index `from`. */
inline Admittance admittance_of(real eta, real k, real from, real c)
{
    Complex index2 = complex_of(eta * eta - k * k, 2.0f * eta * k);
    Admittance m;
    m.s = complex_sqrt(complex_of((eta - from) * (eta + from) - k * k + sqr(from * c), index2.im));
    m.p = complex_div(m.s, index2);
    return m;
}

/* The wave of a polarisation at the top of a stack: the reflected amplitude, and the share of power that
 * reaches a base that does not absorb. */
typedef struct { Complex r; real t; } Wave;

/* Puts a medium on top. The powers' ratio Re Y' / Re Y is dealt out over all boundaries as |Y'| / |Y|,
 * so that grazing light divides nothing by zero. */
inline Wave wave_cross(Wave w, Complex above, Complex below)
{
    Complex sum = complex_add(above, below), difference = complex_sub(above, below);
    Complex d = complex_add(sum, complex_mul(difference, w.r));
    w.r = complex_div(complex_add(difference, complex_mul(sum, w.r)), d);
    real passed = 4.0f * sqrt(complex_norm(above) * complex_norm(below));
    w.t *= passed / max_r(complex_norm(d), (real)(1e-30f));
    return w;
}
/* Down through the topmost medium and up again: there and back `turns` of phase, |amplitude| `left`. */
inline Wave wave_through(Wave w, real turns, real left)
{
    real s, c;
    sincos_2pi(turns - floor(turns), &s, &c);
    w.r = complex_mul(w.r, complex_of(left * c, left * s));
    w.t *= left;
    return w;
}

/* A stack of layers at a wavelength. */
typedef struct { Admittance top; Wave s, p; } Stack;

inline Stack stack_on(real eta, real k, real from, real c)
{
    Stack a;
    a.top = admittance_of(eta, k, from, c);
    a.s.r = a.p.r = complex_of((real)(0.0f), (real)(0.0f));
    a.s.t = a.p.t = sel(a.top.s.re > 0.0f, (real)(1.0f), (real)(0.0f)); /* totally reflected: nothing */
    return a;
}
inline Stack stack_cross(Stack a, Admittance above)
{
    a.s = wave_cross(a.s, above.s, a.top.s);
    a.p = wave_cross(a.p, above.p, a.top.p);
    a.top = above;
    return a;
}
/* Lengths [nm]. */
inline Stack stack_layer(Stack a, Admittance layer, real thickness, real lambda)
{
    a = stack_cross(a, layer);
    real waves = 2.0f * thickness / lambda;
    real turns = layer.s.re * waves, left = exp2_r(layer.s.im * waves * -9.06472028f); /* -2 pi / ln 2 */
    a.s = wave_through(a.s, turns, left);
    a.p = wave_through(a.p, turns, left);
    return a;
}
inline Wave wave_sel(mask m, Wave a, Wave b)
{
    return (Wave){{sel(m, a.r.re, b.r.re), sel(m, a.r.im, b.r.im)}, sel(m, a.t, b.t)};
}
inline Stack stack_sel(mask m, Stack a, Stack b)
{
    Stack r = {{{sel(m, a.top.s.re, b.top.s.re), sel(m, a.top.s.im, b.top.s.im)},
                {sel(m, a.top.p.re, b.top.p.re), sel(m, a.top.p.im, b.top.p.im)}},
               wave_sel(m, a.s, b.s), wave_sel(m, a.p, b.p)};
    return r;
}

/* Step at_once: reflectance and transmittance of a boundary with thin films, all wavelengths at once. */

/* The shares of unpolarised light that come back and go through. Light comes at cosine cos_i from a
 * medium of index `from`; where `outward`, it comes from the base's side and meets the last layer first.
 * eta + i k is the medium that it would enter. layer_at(layers, i) reads a layer, 0 outermost.
 *
 * Where nothing absorbs, what comes back is what does not go through: where films guide light the wave between them
 * is large, and the error of the share that comes back is by its square larger, of the other share by itself. */
inline Boundary thin_film(Layers layers, mask outward, real cos_i, Spectrum from, Spectrum eta, Spectrum k)
{
    real c_i = clamp_r(fabs(cos_i), (real)(1e-4f), (real)(1.0f));
#define C(c) Stack CAT(stack_, c) = stack_on(eta.c, k.c, from.c, c_i);
    SPECTRUM_EACH(C)
#undef C
    Spectrum absorbs = k; /* more than 0 where anything does */
    for (int i = 0; any(i < layers.count); ++i) {
        mask there = i < layers.count;
        integer next = sel_i(outward, (integer)(i), layers.count - 1 - i);
        Layer layer = layer_at(layers, sel_i(there, next, (integer)(0)));
        real thickness = layer.thickness * clamp_r(layer.profile, (real)(0.0f), (real)(1.0f));
#define C(c)                                                                                \
        {                                                                                   \
            Admittance medium = admittance_of(layer.eta.c, layer.k.c, from.c, c_i);         \
            Stack grown = stack_layer(CAT(stack_, c), medium, thickness, layers.lambdas.c); \
            CAT(stack_, c) = stack_sel(there, grown, CAT(stack_, c));                       \
            absorbs.c = sel(there, absorbs.c + layer.k.c, absorbs.c);                       \
        }
        SPECTRUM_EACH(C)
#undef C
    }
    Boundary b;
#define C(c)                                                                                      \
    {                                                                                             \
        Admittance outer = admittance_of(from.c, (real)(0.0f), from.c, c_i);                      \
        Stack whole = stack_cross(CAT(stack_, c), outer);                                         \
        real r = min_r(0.5f * (complex_norm(whole.s.r) + complex_norm(whole.p.r)), (real)(1.0f)); \
        real t = min_r(0.5f * (whole.s.t + whole.p.t), (real)(1.0f));                             \
        b.r.c = sel(absorbs.c > 0.0f, r, 1.0f - t);                                               \
        b.t.c = min_r(t, 1.0f - b.r.c);                                                           \
    }
    SPECTRUM_EACH(C)
#undef C
    return b;
}

/* Step in_turn: the same, a wavelength after the other: four stacks at once need too many registers of a GPU. Each turn
 * reads a layer at a single wavelength. */

inline Boundary thin_film(Layers layers, mask outward, real cos_i, Spectrum from, Spectrum eta, Spectrum k)
{
    real c_i = clamp_r(fabs(cos_i), (real)(1e-4f), (real)(1.0f));
    Boundary b = {spectrum_of(0.0f), spectrum_of(0.0f), 0.0f};
    Spectrum lambdas = layers.lambdas;
#define C(c)                                                                                       \
    {                                                                                              \
        real before = SPECTRUM_AT(from, c), absorbs = SPECTRUM_AT(k, c);                           \
        Stack stack = stack_on(SPECTRUM_AT(eta, c), absorbs, before, c_i);                         \
        layers.lambdas = spectrum_of(SPECTRUM_AT(lambdas, c));                                     \
        for (int i = 0; i < layers.count; ++i) {                                                   \
            Layer layer = layer_at(layers, outward ? i : layers.count - 1 - i);                    \
            real thickness = layer.thickness * clamp_r(layer.profile, (real)(0.0f), (real)(1.0f)); \
            Admittance medium = admittance_of(layer.eta.x, layer.k.x, before, c_i);                \
            stack = stack_layer(stack, medium, thickness, layers.lambdas.x);                       \
            absorbs += layer.k.x;                                                                  \
        }                                                                                          \
        stack = stack_cross(stack, admittance_of(before, (real)(0.0f), before, c_i));              \
        real r = min_r(0.5f * (complex_norm(stack.s.r) + complex_norm(stack.p.r)), (real)(1.0f));  \
        real t = min_r(0.5f * (stack.s.t + stack.p.t), (real)(1.0f));                              \
        r = sel(absorbs > 0.0f, r, 1.0f - t);                                                      \
        SPECTRUM_PUT(b.r, c, r);                                                                   \
        SPECTRUM_PUT(b.t, c, min_r(t, 1.0f - r));                                                  \
    }
    SPECTRUM_IN_TURN(C)
#undef C
    return b;
}
