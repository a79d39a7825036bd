/* What a ray that goes alone meets among instances, by `instances_trace` of a layout. */

/* The nearest hit, if there is one nearer than h: it becomes that one, in the world. */
inline void instances_closest(global const float *nodes, global const float *leaves,
                              global const float *instance_nodes, Scene scene, vec3 o, vec3 d, TriHit tri,
                              TraceHit *h)
{
    if (!ray_finite(o.x, o.y, o.z, d.x, d.y, d.z)) return;
    uint at = instances_trace(nodes, leaves, instance_nodes, scene, o, d, 0.0f, &tri, 0);
    if (at == BVH_MISS) return;
    h->t = tri.t;
    h->u = tri.u;
    h->v = tri.v;
    h->instance = as_int(at) + 1;
    h->prim = as_int(tri.prim) + instance_row_row(scene.instances, as_int(at) * INSTANCE_ROW_WORDS).prim;
    h->shape = as_int(tri.tag);
    h->n = instance_normal(instance_frame(scene, 1, h->instance), v3(tri.nx, tri.ny, tri.nz));
}

inline int instances_occluded(global const float *nodes, global const float *leaves,
                              global const float *instance_nodes, Scene scene, vec3 o, vec3 d, float t)
{
    if (!ray_finite(o.x, o.y, o.z, d.x, d.y, d.z)) return 0;
    TriHit tri = tri_miss(t);
    return instances_trace(nodes, leaves, instance_nodes, scene, o, d, 0.0f, &tri, 1) != BVH_MISS;
}
