/* Isotropic reflection over the halfway and the difference angles (Rusinkiewicz 1998), as MERL measured it. `values`
 * has from `first` on the numbers of MERL_HEAD, the slices of a warp for viewers at even angles to the normal, and f
 * [1/sr]: of every halfway angle, difference angle and azimuth its red, green and blue as halves in two words; after
 * the last azimuth the first again (clpt/render/spectra/measurements.py). */
#include "materials/warp_table.cl"
#define MERL_HEAD 12
#ifndef MERL_COUNT /* where all tables of a scene have the same, these are constants */
#define MERL_COUNT(t, i) warp_count((t).values, (t).first, i)
#endif

typedef struct {
    global const float *values;
    integer first;             /* above 0 */
    Spectrum red, green, blue; /* what each of these is */
} MerlTable;

typedef struct {
    WarpTable warp;
    integer viewers;
    real per_angle; /* of these [1/rad] */
    integer halfway, difference, azimuth; /* steps */
    integer f;                            /* where it begins */
} MerlParts;

inline MerlParts merl_parts(MerlTable t)
{
    MerlParts p;
    p.viewers = MERL_COUNT(t, 0);
    p.per_angle = gather(t.values, t.first + 9);
    p.warp.values = t.values;
    p.warp.first = t.first + MERL_HEAD;
    p.warp.slices = p.viewers;
    p.warp.unit = gather(t.values, t.first + 10);
    p.warp.rows = MERL_COUNT(t, 1);
    p.warp.columns = MERL_COUNT(t, 2);
    p.halfway = MERL_COUNT(t, 3);
    p.difference = MERL_COUNT(t, 4);
    p.azimuth = MERL_COUNT(t, 5);
    p.f = p.warp.first + warp_stride(p.warp);
    return p;
}

/* The viewers around an angle to the normal. */
inline WarpSlices merl_viewers(MerlParts p, real theta)
{
    WarpSlices s;
    real at = clamp_r(theta * p.per_angle, (real)(0.0f), to_real(p.viewers - 1));
    s.slice = min_i(to_integer(at), p.viewers - 2);
    s.near = s.far = (integer)(0);
    s.share.y = at - to_real(s.slice);
    s.share.x = 1.0f - s.share.y;
    s.beyond.x = s.beyond.y = (real)(0.0f);
    s.wide = mask_of(0);
    return s;
}

/* Where the first of two neighbours is whose centres are around `at`, of n even steps; how far it is from there. */
inline integer merl_step(real at, integer n, real *along)
{
    real x = clamp_r(at * to_real(n) - 0.5f, (real)(0.0f), to_real(n - 1));
    integer i = min_i(to_integer(x), n - 2);
    *along = x - to_real(i);
    return i;
}

inline vec3 merl_mixed(vec3 a, vec3 b, real along) { return madd3(sub3(b, a), along, a); }

/* Between two neighbouring azimuths. */
inline vec3 merl_read(MerlTable t, integer at, real along)
{
    vec4 words = gather4(t.values, at);
    vec2 rg = warp_mixed(warp_halves(words.x), warp_halves(words.z), along);
    vec2 b = warp_mixed(warp_halves(words.y), warp_halves(words.w), along);
    return v3(rg.x, rg.y, b.x);
}

/* f of a pair of directions whose halfway direction is h. */
inline vec3 merl_f(MerlTable t, MerlParts p, vec3 h, vec3 wo, vec3 wi)
{
    real sin_h = sqrt_r(h.x * h.x + h.y * h.y), over = 1.0f / max_r(sin_h, (real)(1e-12f));
    real c = sel(sin_h > 1e-9f, h.x * over, (real)(1.0f)), s = h.y * over;
    vec3 apart = sub3(wi, wo), sum = add3(wi, wo);
    real difference = atan2_r(sqrt_r(dot3(apart, apart)), sqrt_r(dot3(sum, sum)));
    real across = h.z * (wi.x * c + wi.y * s) - sin_h * wi.z;
    real turn = atan2_r(wi.y * c - wi.x * s, across) * INV_PI;
    real i_along, j_along, x = (turn - floor(turn)) * to_real(p.azimuth) - 0.5f;
    integer i = merl_step(sqrt_r(atan2_r(sin_h, h.z) * (2.0f * INV_PI)), p.halfway, &i_along);
    integer j = merl_step(difference * (2.0f * INV_PI), p.difference, &j_along);
    real k_along = x - floor(x);
    integer k = to_integer(floor(x)), near = sel_i(k < 0, p.azimuth - 1, k);
    integer width = (p.azimuth + 1) * 2, at = p.f + (i * p.difference + j) * width + 2 * clamp_i(near, p.azimuth - 1);
    integer below = at + p.difference * width;
    vec3 a = merl_mixed(merl_read(t, at, k_along), merl_read(t, at + width, k_along), j_along);
    vec3 b = merl_mixed(merl_read(t, below, k_along), merl_read(t, below + width, k_along), j_along);
    return scale3(merl_mixed(a, b, i_along), gather(t.values, t.first + 11));
}

inline Spectrum merl_spectrum(MerlTable t, vec3 rgb)
{
    Spectrum r = spectrum_scale(t.red, rgb.x);
    return spectrum_madd(t.blue, rgb.z, spectrum_madd(t.green, rgb.y, r));
}

/* Step load: a MerlTable from its four words in `materials`: the first of its numbers in `distributions`, and the rows
 * of the red, green and blue curves in `spectra`. */
inline MerlTable merl_load_table(Scene scene, integer at, Wavelengths lambdas)
{
    MerlTable t;
    t.values = scene.distributions;
    t.first = gather_i(scene.materials, at);
#if SPECTRUM_SIZE == 4
    t.red = spectra_row(scene, gather_i(scene.materials, at + 1), lambdas);
    t.green = spectra_row(scene, gather_i(scene.materials, at + 2), lambdas);
    t.blue = spectra_row(scene, gather_i(scene.materials, at + 3), lambdas);
#else
    t.red = t.green = t.blue = spectrum_of(0.0f);
    t.red.x = t.green.y = t.blue.z = (real)(1.0f);
#endif
    return t;
}
