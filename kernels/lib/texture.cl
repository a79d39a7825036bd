/* The contract of a texture kind: kernels/texture/<kind>.cl has
 *
 *   Spectrum <kind>_reflectance(<Kind> t, Scene scene, TexturePoint point, Wavelengths lambdas);
 *   Spectrum <kind>_emission   (<Kind> t, Scene scene, TexturePoint point, Wavelengths lambdas);
 *   real     <kind>_real       (<Kind> t, Scene scene, TexturePoint point);
 *
 * The struct <Kind> is a Record in clpt/render/textures.py whose rows lie in `textures`. What combines
 * others is no kind here but a program of them: texture/program.cl.
 */

/* A colour or spectrum that stands in `textures` in the five words that parameters have. */
inline Spectrum texture_constant(Scene scene, integer at, Wavelengths lambdas)
{
    Spectrum value = spectrum_constant(scene.textures, at, lambdas);
    mask tabulated = gather_i(scene.textures, at + 4) < 0;
    if (any(tabulated)) value = spectrum_sel(tabulated, spectrum_table(scene, scene.textures, at, lambdas), value);
    return value;
}
