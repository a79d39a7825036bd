/* The contract of a texture kind: kernels/texture/<kind>.cl has
 *
 *   Spectrum <kind>_reflectance(<Kind> t, Scene scene, TexturePoint point, Wavelengths lambdas);
 *   Spectrum <kind>_emission   (<Kind> t, Scene scene, TexturePoint point, Wavelengths lambdas);
 *   real     <kind>_real       (<Kind> t, Scene scene, TexturePoint point);
 *
 * The struct <Kind> is a Record in clpt/render/textures.py whose rows lie in `textures`; it holds the uv transform.
 */
