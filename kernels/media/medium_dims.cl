/* `value` of light after t metres of a medium. */
inline Spectrum medium_dims(Scene scene, integer medium, real t, Wavelengths lambdas, Spectrum value)
{
    return spectrum_mul(value, medium_transmittance(scene, medium, t, lambdas));
}

/* Twin, where a ray may go through several media: it is dimmed as it is traced, see tracing/transmittance_media.cl. */
#define medium_dims(scene, medium, t, lambdas, value) (value)
