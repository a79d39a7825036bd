/* Constants, vectors and elementary functions on lanes. The library's sin, cos, exp and log undo
 * vectorisation on some CPU runtimes, so polynomials replace them; each states its error. */
#define PI 3.14159265358979f
#define INV_PI 0.318309886183791f
#define INV_2PI 0.159154943091895f
#define INV_4PI 0.0795774715459477f
#define FAR 1e30f

inline vec3 v3(real x, real y, real z) { vec3 r = {x, y, z}; return r; }
inline vec4 v4(real x, real y, real z, real w) { vec4 r = {x, y, z, w}; return r; }
inline vec3 add3(vec3 a, vec3 b) { return v3(a.x + b.x, a.y + b.y, a.z + b.z); }
inline vec3 sub3(vec3 a, vec3 b) { return v3(a.x - b.x, a.y - b.y, a.z - b.z); }
inline vec3 scale3(vec3 a, real s) { return v3(a.x * s, a.y * s, a.z * s); }
inline vec3 neg3(vec3 a) { return v3(-a.x, -a.y, -a.z); }
inline vec3 madd3(vec3 a, real s, vec3 b) { return v3(a.x * s + b.x, a.y * s + b.y, a.z * s + b.z); } /* a s + b */
inline real dot3(vec3 a, vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline vec3 cross3(vec3 a, vec3 b) { return v3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x); }
inline vec3 normalize3(vec3 a) { return scale3(a, 1.0f / sqrt(max_r(dot3(a, a), (real)(1e-35f)))); }
inline real sqr(real x) { return x * x; }

/* The power of two that scales |x| into [1, 2), for 2^-126 <= |x| < 2^127; products with it are exact. */
inline real scale_to_one(real x) { return as_real(0x7f000000u - (as_natural(x) & 0x7f800000u)); }

/* The length of a vector whose square may exceed float32, such as an area with sides above 4e9 m; otherwise equal to
 * `sqrt(dot3(v, v))` to the bit. At least 1e-37. */
inline real wide_length3(vec3 v)
{
    real largest = max_r(max_r(max_r(fabs(v.x), fabs(v.y)), fabs(v.z)), (real)(1e-37f));
    v = scale3(v, scale_to_one(largest));
    return sqrt(dot3(v, v)) * as_real(as_natural(largest) & 0x7f800000u);
}

inline real safe_div(real a, real b) { return a / sel(b == 0.0f, (real)(1.0f), b); } /* 0 divisor: a */

/* sin and cos of 2 pi u for u in [0, 1]; absolute error below 3.5e-7. */
inline void sincos_2pi(real u, real *s, real *c)
{
    real x = u - 0.5f, y = x * x; /* half angles of 2 pi (u - 1/2), turned back by the double angle */
    real a = x * (3.14159265f + y * (-5.16771278f + y * (2.55016404f +
                  y * (-0.59926453f + y * (0.08214589f - y * 0.00737043f)))));
    real b = 1.0f + y * (-4.93480220f + y * (4.05871213f + y * (-1.33526277f +
                    y * (0.23533063f + y * (-0.02580689f + y * 0.00192957f)))));
    *s = -2.0f * a * b;
    *c = (a - b) * (a + b);
}

/* cos of 2 pi u for u in [0, 1]; absolute error below 5e-7. */
inline real cos_2pi(real u)
{
    real s, c;
    sincos_2pi(u, &s, &c);
    return c;
}

/* log2 of a positive normal x; relative error below 2e-7 off x = 1 (cephes' logf polynomial). */
inline real log2_r(real x)
{
    natural bits = as_natural(x) - 0x3f3504f3u; /* mantissa in [sqrt(1/2), sqrt(2)) */
    integer e = as_integer(bits) >> 23;
    real f = as_real((bits & 0x007fffffu) + 0x3f3504f3u) - 1.0f, y = f * f;
    real p = f * (f * (f * (f * (f * (f * (f * (f * 7.0376836292e-2f - 1.1514610310e-1f) + 1.1676998740e-1f)
             - 1.2420140846e-1f) + 1.4249322787e-1f) - 1.6668057665e-1f) + 2.0000714765e-1f) - 2.4999993993e-1f)
             + 3.3333331174e-1f;
    return (f - 0.5f * y + f * y * p) * 1.44269504f + to_real(e);
}
inline real log_r(real x) { return log2_r(x) * 0.693147181f; }

/* 2^x, x clamped to [-126, 127]; relative error below 3e-7. */
inline real exp2_r(real x)
{
    x = clamp_r(x, (real)(-126.0f), (real)(127.0f));
    real i = floor(x + 0.5f), f = x - i;
    real p = 1.0f + f * (0.693147182f + f * (0.240226462f + f * (0.0555041886f +
                    f * (0.00961814f + f * (0.00133336f + f * 0.000154148f)))));
    return as_real(as_integer(p) + (to_integer(i) << 23));
}
inline real exp_r(real x) { return exp2_r(x * 1.44269504f); }
inline real pow_r(real x, real y) { return sel(x > 0.0f, exp2_r(y * log2_r(max_r(x, (real)(1e-37f)))), (real)(0.0f)); }

/* acos, |error| < 7e-7 rad; Hastings' form with 8 terms (Abramowitz and Stegun 4.4.46). */
inline real acos_r(real x)
{
    real a = min_r(fabs(x), (real)(1.0f));
    real p = 1.5707963050f + a * (-0.2145988016f + a * (0.0889789874f + a * (-0.0501743046f + a * (0.0308918810f
             + a * (-0.0170881256f + a * (0.0066700901f - a * 0.0012624911f))))));
    p = p * sqrt_r(1.0f - a);
    return sel(x < 0.0f, PI - p, p);
}

/* atan2 in (-pi, pi], |error| < 1e-6 rad; 0 at the origin. */
inline real atan2_r(real y, real x)
{
    real ax = fabs(x), ay = fabs(y), hi = max_r(ax, ay), lo = min_r(ax, ay);
    real t = lo / max_r(hi, (real)(1e-37f));
    mask big = t > 0.41421356f; /* beyond tan(pi/8): turn by pi/4 */
    real z = sel(big, (t - 1.0f) / (t + 1.0f), t), q = z * z;
    real r = z + z * q * (-3.33329491539e-1f + q * (1.99777106478e-1f +
                        q * (-1.38776856032e-1f + q * 8.05374449538e-2f)));
    r = sel(big, r + 0.785398163f, r);
    r = sel(ay > ax, 1.57079633f - r, r);
    r = sel(x < 0.0f, PI - r, r);
    return sel(y < 0.0f, -r, r);
}

/* The azimuth of (x, y) over 2 pi, in [0, 1). */
inline real turn_of(real y, real x)
{
    real turn = atan2_r(y, x) * INV_2PI;
    return turn + sel(turn < 0.0f, (real)(1.0f), (real)(0.0f));
}

/* The error function, |error| < 7e-7 (Abramowitz and Stegun 7.1.26). */
inline real erf_r(real x)
{
    real a = fabs(x), t = 1.0f / (1.0f + 0.3275911f * a);
    real p = t * (0.254829592f + t * (-0.284496736f + t * (1.421413741f + t * (-1.453152027f + t * 1.061405429f))));
    real r = 1.0f - p * exp_r(-a * a);
    return sel(x < 0.0f, -r, r);
}

/* Its inverse for |x| < 1; relative error below 4e-6 for |x| < 0.9999 (Giles 2010, single precision). */
inline real erfinv_r(real x)
{
    real w = -log_r(max_r((1.0f - x) * (1.0f + x), (real)(1e-37f)));
    real a = w - 2.5f, b = sqrt_r(w) - 3.0f;
    real p = 1.50140941f + a * (0.246640727f + a * (-0.00417768164f + a * (-0.00125372503f + a * (0.00021858087f
             + a * (-4.39150654e-6f + a * (-3.5233877e-6f + a * (3.43273939e-7f + a * 2.81022636e-8f)))))));
    real q = 2.83297682f + b * (1.00167406f + b * (0.00943887047f + b * (-0.0076224613f + b * (0.00573950773f
             + b * (-0.00367342844f + b * (0.00134934322f + b * (0.000100950558f - b * 0.000200214257f)))))));
    return x * sel(w < 5.0f, p, q);
}

/* exp(-x) I0(x), the modified Bessel function of order 0, for x >= 0; relative error below 3e-7
 * (Abramowitz and Stegun 9.8.1 and 9.8.2). */
inline real bessel_i0_scaled(real x)
{
    real t = x * (1.0f / 3.75f), q = t * t, s = 1.0f / max_r(t, (real)(1.0f));
    real low = 1.0f + q * (3.5156229f + q * (3.0899424f + q * (1.2067492f +
                      q * (0.2659732f + q * (0.0360768f + q * 0.0045813f)))));
    real high = 0.39894228f + s * (0.01328592f + s * (0.00225319f + s * (-0.00157565f + s * (0.00916281f
              + s * (-0.02057706f + s * (0.02635537f + s * (-0.01647633f + s * 0.00392377f)))))));
    return sel(t < 1.0f, low * exp_r(-x), high / sqrt(max_r(x, (real)(1.0f))));
}

/* a / b for a from 0 to 2^28, b > 0 and a quotient up to 2^20; an integer division would run lane by lane. The quotient
 * of floats has a relative error of about 2^-22, more on some devices: at most 1, which is corrected. */
inline integer divide(integer a, int b)
{
    integer q = to_integer(to_real(a) * (1.0f / (float)b)), left = a - q * b;
    return q + sel_i(left >= b, (integer)(1), (integer)(0)) - sel_i(left < 0, (integer)(1), (integer)(0));
}
