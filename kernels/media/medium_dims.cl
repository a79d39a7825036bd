/* `value` of light after t metres of a medium. */
inline Spectrum medium_dims(Scene scene, integer medium, real t, Wavelengths lambdas, Spectrum value)
{
    return spectrum_mul(value, medium_transmittance(scene, medium, t, lambdas));
}
