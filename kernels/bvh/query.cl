/* An application's rays, one a work-item: what each meets first, and whether it meets anything.
 *
 * Origins and directions stand as x y z behind each other; t is in units of the direction. `t_mins` and
 * `t_maxs` are null where one number holds for all. `begins` tells where the arrays begin in their
 * buffers: origins, directions, t_mins, t_maxs, then t (or met), primitive, barycentrics, instance.
 */
#include "generated/layout.cl"
#include "generated/instance_traversal.cl"

#define RAY_ARGS uint count, uint8 begins, global const float *origins, global const float *directions, \
                 global const float *t_mins, global const float *t_maxs, float t_min, float t_max

#if USES_INSTANCES
#define TREE_ARGS global const float *nodes, global const float *leaves, \
                  global const float *instance_nodes, global const uint *instances
#define HIT_ARGS global float *t, global int *primitive, global float *barycentrics, global int *instance
#else
#define TREE_ARGS global const float *nodes, global const float *leaves
#define HIT_ARGS global float *t, global int *primitive, global float *barycentrics
#endif

#define QUERY_RAY(i)                                                                                     \
    global const float *o = origins + begins.s0 + 3 * i, *d = directions + begins.s1 + 3 * i;            \
    float from = t_mins ? t_mins[begins.s2 + i] : t_min, to = t_maxs ? t_maxs[begins.s3 + i] : t_max;

kernel APART void query_closest(TREE_ARGS, RAY_ARGS, HIT_ARGS)
{
    size_t i = get_global_id(0);
    if (i >= count) return;
    QUERY_RAY(i)
    TriHit hit = tri_miss(to);
#if USES_INSTANCES
    Scene scene = {instances};
    uint row = instances_first(nodes, leaves, instance_nodes, scene, o, d, from, &hit, 0);
    instance[begins.s7 + i] =
        row == BVH_MISS ? -1 : instance_row_row(instances, (int)row * INSTANCE_ROW_WORDS).number;
#else
    hit = LAYOUT(closest)(nodes, leaves, o[0], o[1], o[2], d[0], d[1], d[2], from, to);
#endif
    t[begins.s4 + i] = hit.prim == BVH_MISS ? INFINITY : hit.t;
    primitive[begins.s5 + i] = as_int(hit.prim);
    barycentrics[begins.s6 + 2 * i] = hit.u;
    barycentrics[begins.s6 + 2 * i + 1] = hit.v;
}

kernel APART void query_occluded(TREE_ARGS, RAY_ARGS, global uchar *met)
{
    size_t i = get_global_id(0);
    if (i >= count) return;
    QUERY_RAY(i)
#if USES_INSTANCES
    Scene scene = {instances};
    TriHit hit = tri_miss(to);
    met[begins.s4 + i] = instances_first(nodes, leaves, instance_nodes, scene, o, d, from, &hit, 1) != BVH_MISS;
#else
    met[begins.s4 + i] = LAYOUT(occluded)(nodes, leaves, o[0], o[1], o[2], d[0], d[1], d[2], from, to) != 0;
#endif
}
