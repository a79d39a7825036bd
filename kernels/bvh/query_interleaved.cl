/* bvh/query.cl for a tree that is larger than a processor's caches: BATCH rays a work-item, FLIGHT of them in
 * flight. Where most look the way of their neighbours one after another is quicker, for they need the same
 * memory and the processor foresees where they turn.
 */
#include "bvh/query_rays.cl"
#include "bvh/wide8_interleaved.cl"

#define BATCH 64
#define FLIGHT 8
#define TREE_ARGS global const float *nodes, global const float *leaves

/* Whether three quarters of the rays from `first` on look the way of the one before. */
inline int query_alike(global const float *directions, uint first, uint end)
{
    uint alike = 0;
    float3 before = vload3(first, directions);
    for (uint i = first + 1; i < end; i++) {
        float3 d = vload3(i, directions);
        alike += wide8_alike(before, d);
        before = d;
    }
    return 4 * alike >= 3 * (end - first - 1);
}

inline void query_put(TriHit hit, uint8 begins, uint i, global float *t, global int *primitive,
                      global float *barycentrics)
{
    t[begins.s4 + i] = hit.prim == BVH_MISS ? INFINITY : hit.t;
    primitive[begins.s5 + i] = as_int(hit.prim);
    barycentrics[begins.s6 + 2 * i] = hit.u;
    barycentrics[begins.s6 + 2 * i + 1] = hit.v;
}

/* The rays of a batch: `alone` traces ray i by itself; `onward` goes one on with flight f, and is 0 where ray i
 * has arrived, which `arrived` tells. */
#define QUERY_BATCH(alone, onward, arrived)                                                              \
    uint next = get_global_id(0) * BATCH, end = min(next + BATCH, count), active = FLIGHT;               \
    if (next >= end) return;                                                                             \
    if (query_alike(directions + begins.s1, next, end)) {                                                \
        for (uint i = next; i < end; i++) {                                                              \
            QUERY_RAY(i)                                                                                 \
            alone;                                                                                       \
        }                                                                                                \
        return;                                                                                          \
    }                                                                                                    \
    Wide8RayState states[FLIGHT];                                                                         \
    uint rays[FLIGHT];                                                                                   \
    for (uint k = 0; k < FLIGHT; k++) rays[k] = BVH_MISS;                                                \
    while (active) {                                                                                     \
        active = 0;                                                                                      \
        for (uint k = 0; k < FLIGHT; k++) {                                                              \
            Wide8RayState *f = states + k;                                                                \
            uint i = rays[k];                                                                            \
            int goes = i != BVH_MISS;                                                                    \
            if (!goes) {                                                                                 \
                if (next == end) continue;                                                               \
                i = rays[k] = next++;                                                                    \
                QUERY_RAY(i)                                                                             \
                goes = wide8_start(f, QUERY_ONE);                                                       \
            }                                                                                            \
            active = 1;                                                                                  \
            if (goes && onward) continue;                                                                \
            arrived;                                                                                     \
            rays[k] = BVH_MISS;                                                                          \
        }                                                                                                \
    }

kernel NO_VECTORIZE void query_closest(TREE_ARGS, RAY_ARGS, global float *t, global int *primitive,
                                global float *barycentrics)
{
    QUERY_BATCH(query_put(wide8_closest(nodes, leaves, QUERY_ONE), begins, i, t, primitive, barycentrics),
                wide8_step(nodes, leaves, f),
                query_put(wide8_finish(leaves, f), begins, i, t, primitive, barycentrics))
}

kernel NO_VECTORIZE void query_occluded(TREE_ARGS, RAY_ARGS, global uchar *met)
{
    QUERY_BATCH(met[begins.s4 + i] = wide8_occluded(nodes, leaves, QUERY_ONE) != 0,
                wide8_step_any(nodes, leaves, f),
                met[begins.s4 + i] = f->best != BVH_MISS)
}
