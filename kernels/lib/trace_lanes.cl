/* Tracing in lanes: every triangle against all rays of the work-item. */
#include "lib/trace.cl"
#include "bvh/brute.cl"
#define TRACE_ARGS global const float *tris, uint triangles
#define TRACE tris, triangles

inline TraceHit trace_closest(TRACE_ARGS, Scene scene, vec3 o, vec3 d, real far, mask active)
{
    BruteHit b = brute_closest(tris, triangles, o, d, (real)(0.0f), far, active);
    TraceHit h = {b.t, b.u, b.v, b.n, as_integer(b.prim), as_integer(b.tag)};
    return h;
}
inline mask trace_occluded(TRACE_ARGS, Scene scene, vec3 o, vec3 d, real t, mask active)
{
    return brute_occluded(tris, triangles, o, d, (real)(0.0f), t, active);
}
