/* The contract of a light kind: kernels/lights/kinds/<kind>.cl has, for the kinds that are not on a shape,
 *
 *   LightSample <kind>_sample(<Kind> l, Scene scene, vec3 p, vec2 u, Wavelengths lambdas);
 *
 * which chooses a direction toward the light as seen from p. Those that a ray can meet (infinite ones) have
 *
 *   LightSample <kind>_sample(<Kind> l, Scene scene, vec3 hemisphere, vec2 u, Wavelengths lambdas);
 *   Spectrum <kind>_radiance(<Kind> l, Scene scene, vec3 d, Wavelengths lambdas);   along a ray that leaves the scene
 *   real     <kind>_pdf(<Kind> l, Scene scene, vec3 hemisphere, vec3 d);                  of sample, [1/sr]
 *
 * where `hemisphere` is the unit normal of the hemisphere to which the surface sends light, 0 if to the sphere.
 * The struct <Kind> is made from the dataclass (clpt/render/records/lights.py, where lights with images have
 * Records of their own, and LightSample too); its rows lie in `light_params`. `emission_load` reads an emission;
 * `texture_point_nowhere` stands for the point of a light that has no texture.
 */
#include "generated/light_sample.cl"

/* Whether light from one hemisphere only matters. */
inline mask hemisphere_given(vec3 hemisphere) { return dot3(hemisphere, hemisphere) > 0.5f; }
