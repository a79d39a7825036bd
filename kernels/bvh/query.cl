/* Queries of an application's rays, which are arguments of a kernel.
 *
 * Origins and directions are x y z, packed; t is in units of the direction. `t_mins` and `t_maxs` are null if a
 * number holds for all rays. `begins` are offsets of arrays in their buffers, in elements: origins, directions,
 * t_mins, t_maxs, then outputs.
 */
#define RAY_ARGS uint count, uint8 begins, global const float *origins, global const float *directions, \
                 global const float *t_mins, global const float *t_maxs, float t_min, float t_max

/* Ray i as o[0..2], d[0..2], from, to; 3 i needs more than 32 bits from 1.4 billion rays on. */
#define QUERY_RAY(i)                                                                            \
    size_t ray_at = 3 * (size_t)(i);                                                            \
    global const float *o = origins + begins.s0 + ray_at, *d = directions + begins.s1 + ray_at; \
    float from = t_mins ? t_mins[begins.s2 + i] : t_min, to = t_maxs ? t_maxs[begins.s3 + i] : t_max;
#define QUERY_ONE o[0], o[1], o[2], d[0], d[1], d[2], from, to

/* Step sequential: nearest hits and any-hit answers, a ray a work-item. */
#include "generated/layout.cl"
#include "generated/instance_traversal.cl"

#if USES_INSTANCES
#define TREE_ARGS global const float *nodes, global const float *leaves, \
                  global const float *instance_nodes, global const uint *instances
#define HIT_ARGS global float *t, global int *primitive, global float *barycentrics, global int *instance
#define QUERY_INSTANCES(hit, first_only) \
    query_instances(nodes, leaves, instance_nodes, instances, QUERY_ONE, hit, first_only)

/* The row of the first hit instance, or of any with `first_only`; BVH_MISS without a hit. */
inline uint query_instances(global const float *nodes, global const float *leaves,
                            global const float *instance_nodes, global const uint *instances, float ox,
                            float oy, float oz, float dx, float dy, float dz, float from, float to,
                            TriHit *hit, int first_only)
{
    Scene scene = {instances};
    *hit = tri_miss(to);
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return BVH_MISS;
    return instances_trace(nodes, leaves, instance_nodes, scene, v3(ox, oy, oz), v3(dx, dy, dz), from, hit,
                           first_only);
}
#else
#define TREE_ARGS global const float *nodes, global const float *leaves
#define HIT_ARGS global float *t, global int *primitive, global float *barycentrics
#endif

kernel NO_VECTORIZE void query_closest(TREE_ARGS, RAY_ARGS, HIT_ARGS)
{
    size_t i = get_global_id(0);
    if (i >= count) return;
    QUERY_RAY(i)
#if USES_INSTANCES
    TriHit hit;
    uint row = QUERY_INSTANCES(&hit, 0);
    instance[begins.s7 + i] =
        row == BVH_MISS ? -1 : instance_row_row(instances, (int)row * INSTANCE_ROW_WORDS).number;
#else
    TriHit hit = LAYOUT(closest)(nodes, leaves, QUERY_ONE);
#endif
    t[begins.s4 + i] = hit.prim == BVH_MISS ? INFINITY : hit.t;
    primitive[begins.s5 + i] = as_int(hit.prim);
    barycentrics[begins.s6 + 2 * i] = hit.u;
    barycentrics[begins.s6 + 2 * i + 1] = hit.v;
}

kernel NO_VECTORIZE void query_occluded(TREE_ARGS, RAY_ARGS, global uchar *met)
{
    size_t i = get_global_id(0);
    if (i >= count) return;
    QUERY_RAY(i)
#if USES_INSTANCES
    TriHit hit;
    met[begins.s4 + i] = QUERY_INSTANCES(&hit, 1) != BVH_MISS;
#else
    met[begins.s4 + i] = LAYOUT(occluded)(nodes, leaves, QUERY_ONE) != 0;
#endif
}

/* Step interleaved: the same for a tree larger than a processor's caches: QUERY_RAYS rays a work-item, INTERLEAVED of
 * them in flight. Coherent rays are traced sequentially, which is faster: they read the same memory, and the processor
 * predicts their branches. */
#include "bvh/wide8.cl#interleaved"

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

/* Step all_hits: all hits of each ray: first their number, then, when the host has allocated the arrays, the hits
 * themselves. */
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
