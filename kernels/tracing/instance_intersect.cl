/* A ray and an instance: the ray is transformed into the group's space and traverses its tree by LAYOUT(verb). Its
 * direction is not normalised, so that t is the world's. */
#include "tracing/instances.cl"
#include "generated/motion.cl"
#include "generated/keyed_layout.cl"

/* If the ray hits the instance at row `at` between tmin and hit->t, returns 1 and replaces the hit, in the group's
 * space. With `first_only` the hit stays. */
inline int instance_meet(global const float *nodes, global const float *leaves, Scene scene, uint at, vec3 o,
                         vec3 d, float tmin, TriHit *hit, int first_only)
{
    InstanceRow i = instance_row_row(scene.instances, (int)at * INSTANCE_ROW_WORDS);
#if MOVES_INSTANCES
    i = motion_of_instance(scene, i);
#endif
    vec3 s = {o.x - i.origin.x, o.y - i.origin.y, o.z - i.origin.z};
    vec3 p = {dot3(i.x, s), dot3(i.y, s), dot3(i.z, s)}, v = {dot3(i.x, d), dot3(i.y, d), dot3(i.z, d)};
    nodes += (ulong)i.nodes * 8;
    leaves += (ulong)i.leaves * 8;
#if MOVES_VERTICES
    VertexKeys k = vertex_keys(scene, i.number, scene.time);
    if (k.count > 1) {
        nodes += k.key * KEYED_NODE;
        leaves += k.key * KEYED_LEAF;
        if (first_only) return KEYED(occluded)(nodes, leaves, (uint)k.count, k.share, p, v, tmin, hit->t);
        TriHit met = KEYED(closest)(nodes, leaves, (uint)k.count, k.share, p, v, tmin, hit->t);
        if (met.prim == BVH_MISS) return 0;
        *hit = met;
        return 1;
    }
#endif
    if (first_only) return LAYOUT(occluded)(nodes, leaves, p.x, p.y, p.z, v.x, v.y, v.z, tmin, hit->t);
    TriHit own = LAYOUT(closest)(nodes, leaves, p.x, p.y, p.z, v.x, v.y, v.z, tmin, hit->t);
    if (own.prim == BVH_MISS) return 0;
    *hit = own;
    return 1;
}
