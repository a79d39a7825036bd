/* The shadow ray of a path, from the shadow slab: to a light, or, for a light path, to the camera. */

/* Step. */
#include "shapes/shape.cl"
#include "generated/trace.cl"
#include "tracing/transmittance.cl"
#include "generated/transmittance.cl"
#define ShadowPassage Passage
#define shadow_most(passes) passage_most(passes)
#define shadow_dims(light, passes) passage_dims(light, passes)
#define shadow_adds(light, passes, sum) passage_adds(light, passes, sum)

/* Traces the active shadow rays and clears them; returns their transmittance, 0 to 1. */
inline Passage shadow_ray_transmittance(TRACE_ARGS, Scene scene, Slab path, Slab shadow, uint at, real t, mask active)
{
    vec3 o = load_shadow_o(shadow, at), d = load_shadow_d(shadow, at);
    store_shadow_t(shadow, at, active, (real)(-1.0f));
    return trace_transmittance(TRACE_PASSED, scene, o, d, t, load_path_lambdas(path, at), active);
}

/* Step wavelengths: transmittance along a shadow ray by wavelength. */
#include "shapes/shape.cl"
#include "generated/trace.cl"
#include "generated/transmittance.cl"
#include "generated/escape_light.cl"
#define ShadowPassage Spectrum
#define shadow_most(passes) spectrum_max(passes)
#define shadow_dims(light, passes) spectrum_mul(light, passes)
#define shadow_adds(light, passes, sum) spectrum_add(spectrum_mul(light, passes), sum)

/* Step escapes: the shadow ray of a path, which may be an escape ray out of a sealed medium, see media/escape.cl. */
#include "transport/shadow_ray.cl#wavelengths"

/* Traces the active shadow rays and clears them; returns their transmittance, or the light of escape rays. */
inline Spectrum shadow_ray_transmittance(TRACE_ARGS, Scene scene, Slab path, Slab shadow, uint at, real t, mask active)
{
    vec3 o = load_shadow_o(shadow, at), d = load_shadow_d(shadow, at);
    store_shadow_t(shadow, at, active, (real)(-1.0f));
    Wavelengths lambdas = load_path_lambdas(path, at);
    real straight = trace_transmittance(TRACE_PASSED, scene, o, d, t, lambdas, active & !escape_waits(t));
    return escape_light(TRACE_PASSED, scene, path, at, o, d, t, active, spectrum_of(straight));
}

/* Step media: the shadow ray of a path, which may pass through several media. */
#include "transport/shadow_ray.cl#wavelengths"

/* Traces the active shadow rays and clears them; returns their transmittance, or the light of escape rays. */
inline Spectrum shadow_ray_transmittance(TRACE_ARGS, Scene scene, Slab path, Slab shadow, uint at, real t, mask active)
{
    vec3 o = load_shadow_o(shadow, at), d = load_shadow_d(shadow, at);
    store_shadow_t(shadow, at, active, (real)(-1.0f));
    integer medium = sel_i(active, load_shadow_through(shadow, at), (integer)(0));
    natural key = grid_shadow_key(scene, path, at);
    integer into = sel_i(active, load_shadow_into(shadow, at), (integer)(0));
    Wavelengths lambdas = load_path_lambdas(path, at);
    mask straight = active & !escape_waits(t);
    Spectrum passes = trace_transmittance(TRACE_PASSED, scene, o, d, t, medium, lambdas, straight, key, into);
    return escape_light(TRACE_PASSED, scene, path, at, o, d, t, active, passes);
}
