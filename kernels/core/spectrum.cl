/* Arithmetic of spectra in both modes, component by component. SPECTRUM(x, y, z, w) has the component w in
 * spectral mode only; SPECTRUM_EACH(F) expands F(x) F(y) F(z) and, in that mode, F(w). */
inline Spectrum spectrum_of(real v) { return SPECTRUM(v, v, v, v); }
inline Spectrum spectrum_add(Spectrum a, Spectrum b) { return SPECTRUM(a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w); }
inline Spectrum spectrum_sub(Spectrum a, Spectrum b) { return SPECTRUM(a.x - b.x, a.y - b.y, a.z - b.z, a.w - b.w); }
inline Spectrum spectrum_mul(Spectrum a, Spectrum b) { return SPECTRUM(a.x * b.x, a.y * b.y, a.z * b.z, a.w * b.w); }
inline Spectrum spectrum_div(Spectrum a, Spectrum b) { return SPECTRUM(a.x / b.x, a.y / b.y, a.z / b.z, a.w / b.w); }
inline Spectrum spectrum_scale(Spectrum a, real s) { return SPECTRUM(a.x * s, a.y * s, a.z * s, a.w * s); }
inline Spectrum spectrum_madd(Spectrum a, real s, Spectrum b) /* a s + b */
{
    return SPECTRUM(a.x * s + b.x, a.y * s + b.y, a.z * s + b.z, a.w * s + b.w);
}
inline Spectrum spectrum_sel(mask m, Spectrum a, Spectrum b)
{
    return SPECTRUM(sel(m, a.x, b.x), sel(m, a.y, b.y), sel(m, a.z, b.z), sel(m, a.w, b.w));
}
inline Spectrum spectrum_exp(Spectrum a) { return SPECTRUM(exp_r(a.x), exp_r(a.y), exp_r(a.z), exp_r(a.w)); }
inline Spectrum spectrum_clamped(Spectrum a) /* to [0, 1] */
{
    Spectrum r;
#define C(c) r.c = clamp_r(a.c, (real)(0.0f), (real)(1.0f));
    SPECTRUM_EACH(C)
#undef C
    return r;
}
inline real spectrum_max(Spectrum a) { return SPECTRUM_MAX(a); }
inline real spectrum_mean(Spectrum a) { return SPECTRUM_MEAN(a); }
/* Whether the components differ: a dispersive index. Compares bits, which compilers fold for equal
 * components; numbers they do not fold, since NaN differs from itself. */
inline mask spectrum_varies(Spectrum a)
{
    integer x = as_integer(a.x);
    mask m = as_integer(a.y) != x;
#define C(c) m = m | (as_integer(a.c) != x);
    SPECTRUM_EACH(C)
#undef C
    return m;
}
#include "core/spectrum.cl#at_once"

/* Step at_once: for long computations SPECTRUM_IN_TURN(F) expands F(c) for all components; SPECTRUM_AT(s, c) reads
 * component c, and SPECTRUM_PUT(s, c, v) sets it. */
#define SPECTRUM_IN_TURN(F) SPECTRUM_EACH(F)
#define SPECTRUM_AT(s, c) (s).c
#define SPECTRUM_PUT(s, c, v) (s).c = v

/* Step in_turn: the same macros, component by component: all at once need too many of a GPU's registers. */
inline real spectrum_part(Spectrum s, int number)
{
    int n = 0;
    real v = s.x;
#define C(c) v = number == n++ ? s.c : v;
    SPECTRUM_EACH(C)
#undef C
    return v;
}
inline Spectrum spectrum_with_part(Spectrum s, int number, real v)
{
    int n = 0;
#define C(c) s.c = number == n++ ? v : s.c;
    SPECTRUM_EACH(C)
#undef C
    return s;
}
#define SPECTRUM_IN_TURN(F) \
    ROLLED                  \
    for (int part = 0; part < SPECTRUM_SIZE; part++) { F(part) }
#define SPECTRUM_AT(s, c) spectrum_part(s, c)
#define SPECTRUM_PUT(s, c, v) s = spectrum_with_part(s, c, v)
