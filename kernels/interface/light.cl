/* The contract of a light kind: kernels/light/<kind>.cl has, for the kinds that are not on a shape,
 *
 *   LightSample <kind>_sample(<Kind> l, Scene scene, vec3 p, vec2 u, Wavelengths lambdas);
 *
 * which chooses a direction toward the light as seen from p. Those that a ray can meet (infinite ones) have
 *
 *   LightSample <kind>_sample(<Kind> l, Scene scene, vec3 side, vec2 u, Wavelengths lambdas);
 *   Spectrum <kind>_radiance(<Kind> l, Scene scene, vec3 d, Wavelengths lambdas);   along a ray that leaves the scene
 *   real     <kind>_pdf(<Kind> l, Scene scene, vec3 side, vec3 d);                  of sample, [1/sr]
 *
 * where `side` is the unit normal of the only side of the surface that matters, or 0 where both do.
 * The struct <Kind> is declared as a Record in clpt/render/contract/light_records.py and loaded from
 * `light_params`, and there LightSample.
 */
#include "generated/light_sample.cl"

/* Whether there is only one side to send light to. */
inline mask light_sided(vec3 side) { return dot3(side, side) > 0.5f; }
