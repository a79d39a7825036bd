/* Arithmetic of spectra in both modes, component by component. FOURTH(value) is the last element of a list, in spectral
 * mode only; SPECTRUM_EACH(F) expands F(x) F(y) F(z) and, in that mode, F(w). */
inline Spectrum spectrum_of(real v) { Spectrum r = {v, v, v FOURTH(v)}; return r; }
inline Spectrum spectrum_add(Spectrum a, Spectrum b)
{
    Spectrum r = {a.x + b.x, a.y + b.y, a.z + b.z FOURTH(a.w + b.w)};
    return r;
}
inline Spectrum spectrum_sub(Spectrum a, Spectrum b)
{
    Spectrum r = {a.x - b.x, a.y - b.y, a.z - b.z FOURTH(a.w - b.w)};
    return r;
}
inline Spectrum spectrum_mul(Spectrum a, Spectrum b)
{
    Spectrum r = {a.x * b.x, a.y * b.y, a.z * b.z FOURTH(a.w * b.w)};
    return r;
}
inline Spectrum spectrum_div(Spectrum a, Spectrum b)
{
    Spectrum r = {a.x / b.x, a.y / b.y, a.z / b.z FOURTH(a.w / b.w)};
    return r;
}
inline Spectrum spectrum_scale(Spectrum a, real s)
{
    Spectrum r = {a.x * s, a.y * s, a.z * s FOURTH(a.w * s)};
    return r;
}
inline Spectrum spectrum_madd(Spectrum a, real s, Spectrum b) /* a s + b */
{
    Spectrum r = {a.x * s + b.x, a.y * s + b.y, a.z * s + b.z FOURTH(a.w * s + b.w)};
    return r;
}
inline Spectrum spectrum_sel(mask m, Spectrum a, Spectrum b)
{
    Spectrum r = {sel(m, a.x, b.x), sel(m, a.y, b.y), sel(m, a.z, b.z) FOURTH(sel(m, a.w, b.w))};
    return r;
}
inline Spectrum spectrum_exp(Spectrum a)
{
    Spectrum r = {exp_r(a.x), exp_r(a.y), exp_r(a.z) FOURTH(exp_r(a.w))};
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
#include "core/spectrum_at_once.cl"
