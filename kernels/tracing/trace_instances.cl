/* A single ray's hits of instances, by `instances_trace` of a layout. */
#include "core/rounding.cl"

/* Replaces h by a nearer hit of an instance, in the world. */
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
    InstanceFrame f = instance_frame(scene, 1, h->instance);
    vec3 own = v3(tri.nx, tri.ny, tri.nz), n = instance_normal(f, own);
    real size = triangle_size(tri.side, 1.0f / wide_length3(own));
    h->side = size * instance_stretch(f) + size3(sub3(madd3(d, tri.t, o), f.origin));
    real length = h->side * h->side / wide_length3(n); /* like a triangle that is not thin */
    h->n = scale3(n, length);
    h->plane = tri.plane * f.scale * length + dot3(h->n, f.origin);
}

inline int instances_occluded(global const float *nodes, global const float *leaves,
                              global const float *instance_nodes, Scene scene, vec3 o, vec3 d, float t)
{
    if (!ray_finite(o.x, o.y, o.z, d.x, d.y, d.z)) return 0;
    TriHit tri = tri_miss(t);
    return instances_trace(nodes, leaves, instance_nodes, scene, o, d, 0.0f, &tri, 1) != BVH_MISS;
}
