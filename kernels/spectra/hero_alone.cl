/* A path whose direction holds for its hero alone goes on with one wavelength, see spectra/hero.cl. */
inline void hero_goes_alone(BsdfSample *s, Spectrum *ratio)
{
    mask alone = (s->lobe & LOBE_DISPERSE) != 0;
    if (any(alone)) {
        Spectrum hero = {(real)(4.0f), (real)(0.0f), (real)(0.0f), (real)(0.0f)};
        s->weight = spectrum_sel(alone, spectrum_scale(spectrum_mul(s->weight, hero), 1.0f / ratio->x), s->weight);
        *ratio = spectrum_sel(alone, hero, *ratio);
    }
}

/* Twin, where directions hold for all wavelengths. */
inline void hero_goes_alone(BsdfSample *s, Spectrum *ratio) {}
