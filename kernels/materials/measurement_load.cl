/* A Measurement from its six words in `materials`: the first of its numbers in `distributions`, and a spectrum that
 * says which of its colours each wavelength has. In RGB mode there are three. */
inline Measurement measurement_load(Scene scene, integer at, Wavelengths lambdas)
{
    Measurement t;
    t.values = scene.distributions;
    t.first = gather_i(scene.materials, at);
#if SPECTRUM_SIZE == 4
    vec4 words = v4((real)(0.0f), (real)(0.0f), (real)(0.0f), gather_w(scene.materials, at + 4));
    t.row = spectrum_table(scene, words, gather_i(scene.materials, at + 5), lambdas);
#else
    t.row.x = (real)(0.0f);
    t.row.y = (real)(1.0f);
    t.row.z = (real)(2.0f);
#endif
    return t;
}
