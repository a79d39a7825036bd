/* Albedo of a surface that reflects and gives out light of other wavelengths: over all that comes, per
 * wavelength that leaves. It may exceed one, as the light was taken elsewhere. In RGB mode nothing is
 * taken elsewhere, so a colour brighter than white would be light out of nothing. */
inline Spectrum with_glow(Spectrum elastic, Spectrum glow, real amount)
{
    Spectrum r = spectrum_madd(glow, amount, elastic);
    return SPECTRUM_SIZE == 3 ? spectrum_clamped(r) : r;
}
