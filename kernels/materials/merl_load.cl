/* A MerlTable from its four words in `materials`: the first of its numbers in `distributions`, and the rows of
 * the red, green and blue curves in `spectra`. */
inline MerlTable merl_load_table(Scene scene, integer at, Wavelengths lambdas)
{
    MerlTable t;
    t.values = scene.distributions;
    t.first = gather_i(scene.materials, at);
#if SPECTRUM_SIZE == 4
    t.red = spectra_row(scene, gather_i(scene.materials, at + 1), lambdas);
    t.green = spectra_row(scene, gather_i(scene.materials, at + 2), lambdas);
    t.blue = spectra_row(scene, gather_i(scene.materials, at + 3), lambdas);
#else
    t.red = t.green = t.blue = spectrum_of(0.0f);
    t.red.x = t.green.y = t.blue.z = (real)(1.0f);
#endif
    return t;
}
