/* All hits of each of an application's rays: first their number, then, when the host has allocated the arrays, the
 * hits themselves: see bvh/query_rays.cl. */
#include "bvh/query_rays.cl"
#include "generated/layout.cl"

kernel NO_VECTORIZE void query_count(global const float *nodes, global const float *leaves, RAY_ARGS,
                                     global uint *counts)
{
    size_t i = get_global_id(0);
    if (i >= count) return;
    QUERY_RAY(i)
    HitList nowhere = {0, 0, 0, 0};
    counts[i] = LAYOUT(all_hits)(nodes, leaves, nowhere, QUERY_ONE);
}

kernel NO_VECTORIZE void query_all_hits(global const float *nodes, global const float *leaves, RAY_ARGS,
                                     global const ulong *firsts, global float *t, global int *primitive,
                                     global float *barycentrics)
{
    size_t i = get_global_id(0);
    if (i >= count) return;
    QUERY_RAY(i)
    HitList here = {firsts[i], t, barycentrics, primitive};
    LAYOUT(all_hits)(nodes, leaves, here, QUERY_ONE);
}
