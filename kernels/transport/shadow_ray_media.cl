/* The ray that waits in the shadow slab of a path to a light, where it may go through several media. */
#include "transport/shadow_ray_passage.cl"

/* How much of the light between the two points of each active ray passes. The rays wait no longer. */
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
