/* The weight of a flight over all wavelengths of its path; f: transmittance, times scattering at a collision; pdf:
 * of the distance at each wavelength. */
inline Spectrum flight_weight(Slab path, uint at, mask flies, Spectrum ratio, Spectrum f, Spectrum pdf)
{
    Spectrum pdfs = spectrum_mul(ratio, pdf);
    real mean = spectrum_mean(pdfs), inverse = sel(mean > 1e-30f, 1.0f / mean, (real)(0.0f));
    store_path_ratio(path, at, flies, spectrum_scale(pdfs, inverse));
    return spectrum_scale(f, inverse);
}

/* Twin, where extinction is the same at all wavelengths. */
inline Spectrum flight_weight(Slab path, uint at, mask flies, Spectrum ratio, Spectrum f, Spectrum pdf)
{
    return spectrum_scale(f, 1.0f / max_r(pdf.x, (real)(1e-30f)));
}
