/* Weights of flights through grids over all wavelengths of a path. */

/* Transmittance of a thickness [majorant density times m] at each wavelength, over the largest of them. */
inline Spectrum grid_passes(Medium m, real thickness)
{
    real least = m.sigma_t.x;
#define C(c) least = min_r(least, m.sigma_t.c);
    SPECTRUM_EACH(C)
#undef C
    return spectrum_exp(spectrum_scale(spectrum_sub(m.sigma_t, spectrum_of(least)), -thickness));
}

/* Updates weight and ratio after a thickness since the last collision. value: the factor of the throughput; pdf: of the
 * event; both at each wavelength, without the transmittance, whose common factor cancels. */
inline void grid_weigh(Medium m, real thickness, Spectrum value, Spectrum pdf, mask active, GridFlight *f)
{
    Spectrum passes = grid_passes(m, thickness);
    Spectrum pdfs = spectrum_mul(f->ratio, spectrum_mul(pdf, passes));
    real mean = spectrum_mean(pdfs), inverse = sel(mean > 1e-30f, 1.0f / mean, (real)(0.0f));
    Spectrum weight = spectrum_scale(spectrum_mul(value, passes), inverse);
    f->ratio = spectrum_sel(active, spectrum_scale(pdfs, inverse), f->ratio);
    f->weight = spectrum_sel(active, spectrum_mul(f->weight, weight), f->weight);
}

/* The random number that chooses a wavelength. */
inline real grid_hero(natural bits) { return unit_interval(hash_natural(bits ^ 0x51ed270bu)); }

/* Updates flights that reach the end of the ray. */
inline void grid_weigh_end(Medium m, real thickness, mask active, GridFlight *f)
{
    grid_weigh(m, thickness, spectrum_of(1.0f), spectrum_of(1.0f), active, f);
}

/* Twin, where extinction is the same at all wavelengths. */
inline void grid_weigh(Medium m, real thickness, Spectrum value, Spectrum pdf, mask active, GridFlight *f)
{
    Spectrum weight = spectrum_scale(value, 1.0f / max_r(pdf.x, (real)(1e-30f)));
    f->weight = spectrum_sel(active, spectrum_mul(f->weight, weight), f->weight);
}
inline real grid_hero(natural bits) { return (real)(0.0f); }
inline void grid_weigh_end(Medium m, real thickness, mask active, GridFlight *f) {}
