/* bvh/query.cl for a tree larger than a processor's caches: QUERY_RAYS rays a work-item, INTERLEAVED of them in
 * flight. Coherent rays are traced sequentially, which is faster: they read the same memory, and the processor
 * predicts their branches. */
#include "bvh/query_rays.cl"
#include "bvh/wide8_interleaved.cl"

#include "generated/query_sizes.cl"
#define INTERLEAVED 8
#define TREE_ARGS global const float *nodes, global const float *leaves

/* Whether three quarters of the rays from `first` on have about their predecessor's direction. */
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
    vstore2((float2)(hit.u, hit.v), i, barycentrics + begins.s6);
}

/* The rays of a batch: `alone` traces ray i; `step` advances state s and returns 0 at the end of ray i, where `finish`
 * stores its hit. */
#define QUERY_BATCH(alone, step, finish)                                                        \
    uint next = get_global_id(0) * QUERY_RAYS, end = min(next + QUERY_RAYS, count);             \
    uint active = INTERLEAVED;                                                                  \
    if (next >= end) return;                                                                    \
    if (query_alike(directions + begins.s1, next, end)) {                                       \
        for (uint i = next; i < end; i++) {                                                     \
            QUERY_RAY(i)                                                                        \
            alone;                                                                              \
        }                                                                                       \
        return;                                                                                 \
    }                                                                                           \
    Wide8RayState states[INTERLEAVED];                                                          \
    uint rays[INTERLEAVED];                                                                     \
    for (uint k = 0; k < INTERLEAVED; k++) rays[k] = BVH_MISS;                                  \
    while (active) {                                                                            \
        active = 0;                                                                             \
        for (uint k = 0; k < INTERLEAVED; k++) {                                                \
            Wide8RayState *s = states + k;                                                      \
            uint i = rays[k];                                                                   \
            int goes = i != BVH_MISS;                                                           \
            if (!goes) {                                                                        \
                if (next == end) continue;                                                      \
                i = rays[k] = next++;                                                           \
                QUERY_RAY(i)                                                                    \
                goes = wide8_start(s, QUERY_ONE);                                               \
            }                                                                                   \
            active = 1;                                                                         \
            if (goes && step) continue;                                                         \
            finish;                                                                             \
            rays[k] = BVH_MISS;                                                                 \
        }                                                                                       \
    }

kernel NO_VECTORIZE void query_closest(TREE_ARGS, RAY_ARGS, global float *t, global int *primitive,
                                       global float *barycentrics)
{
    QUERY_BATCH(query_put(wide8_closest(nodes, leaves, QUERY_ONE), begins, i, t, primitive, barycentrics),
                wide8_step(nodes, leaves, s),
                query_put(wide8_finish(leaves, s), begins, i, t, primitive, barycentrics))
}

kernel NO_VECTORIZE void query_occluded(TREE_ARGS, RAY_ARGS, global uchar *met)
{
    QUERY_BATCH(met[begins.s4 + i] = wide8_occluded(nodes, leaves, QUERY_ONE) != 0,
                wide8_step_any(nodes, leaves, s),
                met[begins.s4 + i] = s->best != BVH_MISS)
}
