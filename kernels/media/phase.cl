/* Shared by phase functions that depend on the wavelength: a density over the cosine of the scattering angle for each
 * wavelength. Spectral mode samples the density of the hero wavelength, and spectra/hero.cl weighs all four. RGB mode
 * samples a random component, and the pdf is the mean of the three; equal components need no choice. */

/* Step. */
#if SPECTRUM_SIZE == 4
inline mask phase_same(Spectrum s) { return mask_of(1); }
inline integer phase_component(mask same, real *u) { return (integer)(0); }
inline real phase_part(Spectrum s, integer component) { return s.x; }
inline real phase_pdf(Spectrum densities, mask same) { return densities.x; }
#else
inline mask phase_same(Spectrum s) { return (s.x == s.y) & (s.x == s.z); }
/* The sampled component; *u is rescaled to a new random number. */
inline integer phase_component(mask same, real *u)
{
    integer one = min_i(to_integer(3.0f * *u), (integer)(2));
    *u = sel(same, *u, clamp_r(3.0f * *u - to_real(one), (real)(0.0f), (real)(0.99999994f)));
    return sel_i(same, (integer)(0), one);
}
inline real phase_part(Spectrum s, integer component)
{
    return sel(component == 0, s.x, sel(component == 1, s.y, s.z));
}
inline real phase_pdf(Spectrum densities, mask same) { return sel(same, densities.x, spectrum_mean(densities)); }
#endif

/* A sample of the uniform density over the sphere. */
inline BsdfSample phase_uniform(vec3 u, Spectrum weight)
{
    BsdfSample s = bsdf_nothing();
    vec2 point = {u.x, u.y};
    s.wi = uniform_sphere(point);
    s.weight = weight;
    s.pdf = 0.25f * INV_PI;
    s.lobe = LOBE_TRANSMIT;
    return s;
}

/* The sample of a scattering angle with this cosine; u: azimuth over 2 pi. */
inline BsdfSample phase_turned(real cosine, real u)
{
    BsdfSample s = bsdf_nothing();
    real r = sqrt_r(1.0f - cosine * cosine), x, y;
    sincos_2pi(u, &y, &x);
    s.wi = v3(r * x, r * y, -cosine);
    s.lobe = LOBE_TRANSMIT;
    return s;
}
/* That sample with its weight and pdf; densities: the value at each wavelength [1/sr]. */
inline BsdfSample phase_weighed(BsdfSample s, Spectrum densities, mask same)
{
    s.pdf = phase_pdf(densities, same);
    real pdf = max_r(s.pdf, (real)(1e-30f));
#define C(c) s.weight.c = densities.c / pdf; /* exactly 1 at the sampled wavelength */
    SPECTRUM_EACH(C)
#undef C
    return s;
}

/* Henyey and Greenstein's density [1/sr] of a cosine, and the cosine for a random number u, 1 at u = 0. */
inline real hg_density(real g, real turn)
{
    real below = max_r(1.0f + g * g - 2.0f * g * turn, (real)(1e-12f));
    return 0.25f * INV_PI * (1.0f - g * g) / (below * sqrt(below));
}
inline real hg_turn(real of, real u)
{
    mask even = fabs(of) < 1e-3f;
    real g = sel(even, (real)(1.0f), of);
    real root = (1.0f - g * g) / (1.0f + g - 2.0f * g * u);
    real turn = clamp_r((1.0f + g * g - root * root) / (2.0f * g), (real)(-1.0f), (real)(1.0f));
    return sel(even, 1.0f - 2.0f * u, turn);
}

/* Step frame: the shading frame of a point in a medium: z points against the ray. */
typedef struct { Frame frame; } ShadingFrame;

inline ShadingFrame shading_frame_load(Scene scene, integer row, Surface s, vec3 d, Wavelengths lambdas)
{
    return (ShadingFrame){frame_of(neg3(d))};
}
inline mask shading_frame_turns(Scene scene, integer row) { return mask_of(0); }
inline real shading_frame_share(ShadingFrame f, vec3 w) { return 1.0f; }
