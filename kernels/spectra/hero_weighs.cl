/* Densities of directions that differ between the wavelengths of a path, see spectra/hero.cl. */

/* pdf of the directions that are not delta [1/sr]. */
inline real hero_pdf(Bsdf m, vec3 wo, vec3 wi, Spectrum ratio)
{
    return spectrum_mean(spectrum_mul(ratio, bsdf_pdfs(m, wo, wi)));
}

/* Weighs a sample over all wavelengths. */
inline void hero_weighs(Bsdf m, vec3 wo, BsdfSample *s, Spectrum *ratio)
{
    Spectrum pdfs = spectrum_mul(*ratio, bsdf_pdfs(m, wo, s->wi));
    real pdf = spectrum_mean(pdfs);
    mask usable = (s->pdf > 0.0f) & (pdf > 0.0f);
    real inv = 1.0f / sel(usable, pdf, (real)(1.0f));
    *ratio = spectrum_sel(usable, spectrum_scale(pdfs, inv), *ratio);
    s->weight = spectrum_scale(s->weight, sel(usable, s->pdf * inv, (real)(1.0f)));
    s->pdf = sel(usable, pdf, (real)(0.0f));
}

/* Twin, where densities of directions are those of all wavelengths. */
inline real hero_pdf(Bsdf m, vec3 wo, vec3 wi, Spectrum ratio) { return bsdf_pdf(m, wo, wi); }
inline void hero_weighs(Bsdf m, vec3 wo, BsdfSample *s, Spectrum *ratio) {}
