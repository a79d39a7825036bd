/* The ray that waits in the shadow slab of a path: to a light, or out of a sealed medium, see media/escape.cl. */
#include "transport/shadow_ray_passage.cl"

/* How much of the light between the two points of each active ray passes, or comes. The rays wait no longer. */
inline Spectrum shadow_ray_transmittance(TRACE_ARGS, Scene scene, Slab path, Slab shadow, uint at, real t, mask active)
{
    vec3 o = load_shadow_o(shadow, at), d = load_shadow_d(shadow, at);
    store_shadow_t(shadow, at, active, (real)(-1.0f));
    Wavelengths lambdas = load_path_lambdas(path, at);
    real straight = trace_transmittance(TRACE_PASSED, scene, o, d, t, lambdas, active & !escape_waits(t));
    return escape_light(TRACE_PASSED, scene, path, at, o, d, t, active, spectrum_of(straight));
}
