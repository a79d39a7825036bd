/* The luminance of a reflectance under D65, 1 for white, and its wavelengths [nm]: nodes of the four-point Gauss
 * quadrature with the CIE 1931 luminosity times D65 as weight. Its error is 1% in the mean of random colours,
 * 17% for the most saturated colours. */
#if SPECTRUM_SIZE == 3
inline Spectrum luminance_lambdas(void) { return spectrum_of(0.0f); }
inline real luminance_of(Spectrum s) { return 0.2126f * s.x + 0.7152f * s.y + 0.0722f * s.z; }
#else
inline Spectrum luminance_lambdas(void)
{
    return (Spectrum){(real)(462.5986f), (real)(529.7404f), (real)(591.5357f), (real)(658.8561f)};
}
inline real luminance_of(Spectrum s)
{
    return 0.0516476f * s.x + 0.4956375f * s.y + 0.4151113f * s.z + 0.0376036f * s.w;
}
#endif
