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
