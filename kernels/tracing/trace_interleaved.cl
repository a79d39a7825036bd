/* Interleaved tracing of a work-item's rays through the 8-wide tree, for trees of triangles larger than a processor's
 * caches. Coherent rays are traced sequentially: see bvh/query.cl. */
#include "tracing/trace.cl"
#include "bvh/wide8.cl#interleaved"
#include "generated/trace_args.cl"
#include "tracing/trace_each.cl"

/* Whether three quarters of the rays have about their predecessor's direction. */
inline int trace_alike(const TraceRays *r, const uint *rays, uint count)
{
    uint alike = 0;
    for (uint k = 1; k < count; k++) {
        uint i = rays[k - 1], j = rays[k];
        alike += wide8_alike((float3)(r->dx.at[i], r->dy.at[i], r->dz.at[i]),
                             (float3)(r->dx.at[j], r->dy.at[j], r->dz.at[j]));
    }
    return 4 * alike + 3 >= 3 * count;
}

/* Steps every ray in turn, until all have finished. */
inline void trace_step_all(global const float *nodes, global const float *leaves, const TraceRays *r, uint *rays,
                           uint active, TraceHits *h)
{
    Wide8RayState states[LANES];
    for (int started = 0; active; started = 1) {
        uint left = 0;
        for (uint k = 0; k < active; k++) {
            uint i = rays[k];
            Wide8RayState *s = states + i;
            int goes = started || wide8_start(s, TRACE_RAY(r, i));
            if (goes && wide8_step(nodes, leaves, s))
                rays[left++] = i;
            else
                trace_put(h, i, wide8_finish(leaves, s));
        }
        active = left;
    }
}

inline TraceHit trace_closest(TRACE_ARGS, Scene scene, vec3 o, vec3 d, real far, mask active)
{
    TraceHits h = trace_missed(far);
    TraceRays r = trace_rays(o, d, far);
    uint rays[LANES], count = trace_active(active, rays);
    if (!trace_alike(&r, rays, count)) {
        trace_step_all(nodes, leaves, &r, rays, count, &h);
    } else {
        for (uint k = 0; k < count; k++)
            trace_put(&h, rays[k], wide8_closest(nodes, leaves, TRACE_RAY(&r, rays[k])));
    }
    return trace_together(h);
}
