/* Arithmetic of spectra, for either mode: component by component through SPECTRUM_EACH(F), which
 * expands F(x) F(y) F(z) and, in spectral mode, F(w). */
inline Spectrum spectrum_of(real v)
{
    Spectrum r;
#define C(c) r.c = v;
    SPECTRUM_EACH(C)
#undef C
    return r;
}
inline Spectrum spectrum_add(Spectrum a, Spectrum b)
{
    Spectrum r;
#define C(c) r.c = a.c + b.c;
    SPECTRUM_EACH(C)
#undef C
    return r;
}
inline Spectrum spectrum_sub(Spectrum a, Spectrum b)
{
    Spectrum r;
#define C(c) r.c = a.c - b.c;
    SPECTRUM_EACH(C)
#undef C
    return r;
}
inline Spectrum spectrum_mul(Spectrum a, Spectrum b)
{
    Spectrum r;
#define C(c) r.c = a.c * b.c;
    SPECTRUM_EACH(C)
#undef C
    return r;
}
inline Spectrum spectrum_div(Spectrum a, Spectrum b)
{
    Spectrum r;
#define C(c) r.c = a.c / b.c;
    SPECTRUM_EACH(C)
#undef C
    return r;
}
inline Spectrum spectrum_scale(Spectrum a, real s)
{
    Spectrum r;
#define C(c) r.c = a.c * s;
    SPECTRUM_EACH(C)
#undef C
    return r;
}
inline Spectrum spectrum_madd(Spectrum a, real s, Spectrum b) /* a s + b */
{
    Spectrum r;
#define C(c) r.c = a.c * s + b.c;
    SPECTRUM_EACH(C)
#undef C
    return r;
}
inline Spectrum spectrum_sel(mask m, Spectrum a, Spectrum b)
{
    Spectrum r;
#define C(c) r.c = sel(m, a.c, b.c);
    SPECTRUM_EACH(C)
#undef C
    return r;
}
inline Spectrum spectrum_exp(Spectrum a)
{
    Spectrum r;
#define C(c) r.c = exp_r(a.c);
    SPECTRUM_EACH(C)
#undef C
    return r;
}
inline Spectrum spectrum_clamped(Spectrum a) /* to [0, 1] */
{
    Spectrum r;
#define C(c) r.c = clamp_r(a.c, (real)(0.0f), (real)(1.0f));
    SPECTRUM_EACH(C)
#undef C
    return r;
}
inline real spectrum_max(Spectrum a)
{
    real r = max_r(max_r(a.x, a.y), a.z);
#if SPECTRUM_SIZE == 4
    r = max_r(r, a.w);
#endif
    return r;
}
inline real spectrum_mean(Spectrum a) { return SPECTRUM_MEAN(a); }
/* Whether the components differ: a dispersive index. By their bits, which compilers know to be the same where all are
 * one number; of numbers they do not, as NaN is not itself. */
inline mask spectrum_varies(Spectrum a)
{
    integer x = as_integer(a.x);
    mask m = (as_integer(a.y) != x) | (as_integer(a.z) != x);
#if SPECTRUM_SIZE == 4
    m = m | (as_integer(a.w) != x);
#endif
    return m;
}
