/* Diffraction by the scalar theory of a thin grating: the groove delays the wave by `path` [nm], and an order's
 * share is the squared Fourier coefficient of this phase over a period (Goodman 2005, 4.4; Stam 1999 and Werner et
 * al. 2017 in rendering). */
#include "generated/grating_sizes.cl"
#define BESSEL_SMALL 6.0f    /* up to these arguments the recurrence starts at 20, */
#define BESSEL_LARGEST 24.0f /* and at 40 */
#define GRATING_SINUSOIDAL 0
#define GRATING_LAMELLAR 1
#define GRATING_BLAZED 2
#define GRATING_EXPLICIT 3

/* Bessel's J_n(x) for 0 < x, from orders well above x and n downward (Miller's recurrence), normalised
 * by 1 = J_0 + 2 (J_2 + J_4 + ...) (Abramowitz and Stegun 9.12). */
inline real bessel_from(int first, int n, real x)
{
    real slope = 2.0f / x, above = 0.0f, here = 1e-20f, sum = 0.0f, wanted = 0.0f;
    for (int k = first; k > 0; k--) {
        real below = (float)k * slope * here - above;
        real shrink = sel(fabs(below) > 1e10f, (real)(1e-20f), (real)(1.0f));
        above = here * shrink;
        here = below * shrink;
        wanted = k - 1 == n ? here : wanted * shrink;
        sum = sum * shrink + (k == 1 ? here : (k & 1) ? 2.0f * here : (real)(0.0f));
    }
    return wanted / sel(sum == 0.0f, (real)(1.0f), sum);
}
/* J_n(x) for x >= 0 and n of 0 to 8, the same for all lanes; error below 6e-6; x is cut at 24. */
inline real bessel_r(int n, real x)
{
    mask large = x > BESSEL_SMALL;
    real r = bessel_from(20, n, clamp_r(x, (real)(1e-5f), (real)(BESSEL_SMALL)));
    if (any(large)) r = sel(large, bessel_from(40, n, clamp_r(x, (real)(BESSEL_SMALL), (real)(BESSEL_LARGEST))), r);
    return r;
}

inline real sine_turns(real x) /* sin(2 pi x) */
{
    real s, c;
    sincos_2pi(x - floor(x), &s, &c);
    return s;
}
inline real sinc_r(real x) /* sin(pi x) / (pi x) */
{
    return sel(fabs(x) < 1e-3f, (real)(1.0f), sine_turns(0.5f * x) / (PI * sel(x == 0.0f, (real)(1.0f), x)));
}

/* The share of order n; waves: the delay from crest to trough in wavelengths, fill: share of the
 * period that a lamellar grating's crests take. */
inline real sinusoidal_share(int n, real waves) { return sqr(bessel_r(abs(n), PI * fabs(waves))); }
inline real blazed_share(int n, real waves) { return sqr(sinc_r(waves - (float)n)); }
inline real lamellar_share(int n, real waves, real fill)
{
    real contrast = 4.0f * sqr(sine_turns(0.5f * waves));
    return n == 0 ? 1.0f - fill * (1.0f - fill) * contrast : contrast * sqr(fill * sinc_r((float)n * fill));
}

/* The wavelengths of a dispersive event. `share`: the weights of the components where all keep the direction; `alone`:
 * where the direction is the hero's. */
typedef struct {
    Spectrum lambdas, share, alone;
    real pdf;
} Parted;

#if SPECTRUM_SIZE == 4
inline Parted part_wavelengths(Spectrum lambdas, real u)
{
    Parted p;
    p.lambdas = lambdas;
    p.share = spectrum_of(1.0f);
    p.alone = spectrum_of(0.0f);
    p.alone.x = 1.0f;
    p.pdf = 1.0f;
    return p;
}
#else
/* RGB mode: a random wavelength from 420 to 660 nm. It counts for blue around 460, green around
 * 540 and red around 620 nm by overlapping hats of mean 1, so that white stays white. */
inline Parted part_wavelengths(Spectrum lambdas, real u)
{
    Parted p;
    p.lambdas = spectrum_of(420.0f + 240.0f * u);
    p.share.x = 3.0f * clamp_r(3.0f * u - 1.5f, (real)(0.0f), (real)(1.0f));
    p.share.z = 3.0f * clamp_r(1.5f - 3.0f * u, (real)(0.0f), (real)(1.0f));
    p.share.y = 3.0f - p.share.x - p.share.z;
    p.alone = p.share;
    p.pdf = 1.0f / 3.0f;
    return p;
}
#endif
