/* What phase functions that depend on the wavelength share. Each has a density over the cosine of the angle by which
 * light turns, for each wavelength. In spectral mode the hero's is sampled, and spectra/hero.cl weighs all four. In RGB
 * mode one of the three is chosen, and the density is their mean; where the three are the same nothing is chosen. */
#if SPECTRUM_SIZE == 4
inline mask phase_same(Spectrum s) { return mask_of(1); }
inline integer phase_component(mask same, real *u) { return (integer)(0); }
inline real phase_part(Spectrum s, integer component) { return s.x; }
inline real phase_pdf(Spectrum densities, mask same) { return densities.x; }
#else
inline mask phase_same(Spectrum s) { return (s.x == s.y) & (s.x == s.z); }
/* Which of the three is sampled; what is left of u is as good as new. */
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

/* The sample that turns light by an angle of this cosine, and by u of a full turn around. */
inline BsdfSample phase_turned(real cosine, real u)
{
    BsdfSample s = bsdf_nothing();
    real r = sqrt_r(1.0f - cosine * cosine), x, y;
    sincos_2pi(u, &y, &x);
    s.wi = v3(r * x, r * y, -cosine);
    s.lobe = LOBE_TRANSMIT;
    return s;
}
/* That sample with its weight and pdf; densities: of each wavelength there. */
inline BsdfSample phase_weighed(BsdfSample s, Spectrum densities, mask same)
{
    s.pdf = phase_pdf(densities, same);
    real pdf = max_r(s.pdf, (real)(1e-30f));
#define C(c) s.weight.c = densities.c / pdf; /* exactly 1 of the wavelength that was sampled */
    SPECTRUM_EACH(C)
#undef C
    return s;
}
