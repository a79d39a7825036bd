/* The ray that waits in the shadow slab of a path to a light, where it may go through several media. */
#include "interface/shape.cl"
#include "generated/trace.cl"
#include "generated/transmittance.cl"

/* How much of the light between the two points of each active ray passes. The rays wait no longer. */
inline Spectrum shadow_ray_transmittance(TRACE_ARGS, Scene scene, Slab path, Slab shadow, uint at, real t, mask active)
{
    vec3 o = load_shadow_o(shadow, at), d = load_shadow_d(shadow, at);
    store_shadow_t(shadow, at, active, (real)(-1.0f));
    integer medium = sel_i(active, load_shadow_through(shadow, at), (integer)(0));
    natural key = 0u;
    integer into = 0;
#if USES_GRIDS
    integer vertex = (load_path_state(path, at) & PATH_DEPTH) + load_path_nulls(path, at);
    key = ~grid_key(scene, load_path_pixel_key(path, at), load_path_sample(path, at), vertex);
#endif
#if BRICK_LIGHTS
    into = sel_i(active, load_shadow_into(shadow, at), (integer)(0));
#endif
    return trace_transmittance(TRACE_PASSED, scene, o, d, t, medium, load_path_lambdas(path, at), active, key, into);
}
