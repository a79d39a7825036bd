/* The luminance of a reflectance under D65, that of white being one, and the wavelengths [nm] at which the reflectance
 * has to be known for that: nodes of the four-point Gauss quadrature whose weight is the CIE 1931 luminosity times
 * D65. Of random colours it is off by 1% in the mean, of the most saturated ones by 17%. */
#if SPECTRUM_SIZE == 3
inline Spectrum luminance_lambdas(void) { return spectrum_of(0.0f); }
inline real luminance_of(Spectrum s) { return 0.2126f * s.x + 0.7152f * s.y + 0.0722f * s.z; }
#else
inline Spectrum luminance_lambdas(void)
{
    Spectrum r = {(real)(462.5986f), (real)(529.7404f), (real)(591.5357f), (real)(658.8561f)};
    return r;
}
inline real luminance_of(Spectrum s)
{
    return 0.0516476f * s.x + 0.4956375f * s.y + 0.4151113f * s.z + 0.0376036f * s.w;
}
#endif
