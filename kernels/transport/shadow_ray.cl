/* The ray that waits in the shadow slab of a path: to a light, or, from a light, to the camera. */
#include "shapes/shape.cl"
#include "generated/trace.cl"
#include "tracing/transmittance.cl"
#include "generated/transmittance.cl"
#define ShadowPassage Passage
#define shadow_most(passes) passage_most(passes)
#define shadow_dims(light, passes) passage_dims(light, passes)
#define shadow_adds(light, passes, sum) passage_adds(light, passes, sum)

/* How much of the light between the two points of each active ray passes, 0 to 1. The rays wait no longer. */
inline Passage shadow_ray_transmittance(TRACE_ARGS, Scene scene, Slab path, Slab shadow, uint at, real t, mask active)
{
    vec3 o = load_shadow_o(shadow, at), d = load_shadow_d(shadow, at);
    store_shadow_t(shadow, at, active, (real)(-1.0f));
    return trace_transmittance(TRACE_PASSED, scene, o, d, t, load_path_lambdas(path, at), active);
}
