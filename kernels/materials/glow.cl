/* Albedo of a fluorescent surface: light over all incident wavelengths, per outgoing wavelength. It may exceed 1
 * because the light comes from other wavelengths. RGB mode moves no light between wavelengths, so a colour brighter
 * than white would create light. */
inline Spectrum with_glow(Spectrum elastic, Spectrum glow, real amount)
{
    Spectrum r = spectrum_madd(glow, amount, elastic);
    return SPECTRUM_SIZE == 3 ? spectrum_clamped(r) : r;
}
