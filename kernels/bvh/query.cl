/* Nearest hits and any-hit answers for an application's rays, a ray a work-item: see bvh/query_rays.cl. */
#include "bvh/query_rays.cl"
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
