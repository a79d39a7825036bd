/* `value` times the transmittance of t metres of a medium. */
inline Spectrum medium_dims(Scene scene, integer medium, real t, Wavelengths lambdas, Spectrum value)
{
    return spectrum_mul(value, medium_transmittance(scene, medium, t, lambdas));
}

/* Twin, where a shadow ray may go through several media: tracing/transmittance.cl multiplies as it is traced. */
inline Spectrum medium_dims(Scene scene, integer medium, real t, Wavelengths lambdas, Spectrum value) { return value; }
