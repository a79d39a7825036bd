/* The tree over instances, for traversals that go one ray a work-item. At a leaf the ray is turned into
 * the group's space and goes through its tree by LAYOUT(verb). Its direction keeps the length that it
 * gets, so that t is the world's. */
#include "lib/instances.cl"
#define INSTANCES instance_nodes, instance_items
#define INSTANCE_ARGS global const float *instance_nodes, global const uint *instance_items

/* A group's tree, and a ray in its space. */
typedef struct { global const float *nodes, *leaves; vec3 o, d; } InstanceRay;

inline InstanceRay instance_ray(Scene scene, global const float *nodes, global const float *leaves, uint at,
                                const Ray *ray)
{
    InstanceRow i = instance_row_row(scene.instances, (int)at * INSTANCE_ROW_WORDS);
    vec3 o = {ray->o.x - i.origin.x, ray->o.y - i.origin.y, ray->o.z - i.origin.z};
    vec3 d = {ray->d.x, ray->d.y, ray->d.z};
    InstanceRay r = {nodes + (ulong)i.nodes * 8, leaves + (ulong)i.leaves * 8,
                     {dot3(i.x, o), dot3(i.y, o), dot3(i.z, o)}, {dot3(i.x, d), dot3(i.y, d), dot3(i.z, d)}};
    return r;
}

/* If an instance is met between ray->tmin and hit->t, the hit becomes that one, still in the group's space;
 * its row is returned, else BVH_MISS. With `first_only` any will do, and the hit stays. */
inline uint instances_trace(global const float *nodes, global const float *leaves, INSTANCE_ARGS, Scene scene,
                            const Ray *ray, TriHit *hit, int first_only)
{
    global const float8 *tree = (global const float8 *)instance_nodes;
    uint waiting[BVH_DEPTH];
    float entries[BVH_DEPTH];
    uint n = 0, found = BVH_MISS;
    float8 node = tree[0];
    float entry = ray_enter(ray, node, hit->t);
    for (;;) {
        if (entry < INFINITY && !node_is_leaf(node)) {
            uint left = node_link(node);
            float8 other = tree[left + 1];
            node = tree[left];
            entry = ray_enter(ray, node, hit->t);
            float other_entry = ray_enter(ray, other, hit->t);
            if (fmax(entry, other_entry) < INFINITY) { /* both: the farther one waits */
                waiting[n] = left + (other_entry >= entry);
                entries[n++] = fmax(entry, other_entry);
            }
            if (other_entry < entry) {
                node = other;
                entry = other_entry;
            }
            continue;
        }
        if (entry < INFINITY) {
            uint begin = node_link(node), end = begin + node_count(node);
            for (uint i = begin; i < end; i++) {
                uint at = instance_items[i];
                InstanceRay r = instance_ray(scene, nodes, leaves, at, ray);
                if (first_only) {
                    if (LAYOUT(occluded)(r.nodes, r.leaves, r.o.x, r.o.y, r.o.z, r.d.x, r.d.y, r.d.z, ray->tmin, hit->t))
                        return at;
                } else {
                    TriHit own = LAYOUT(closest)(r.nodes, r.leaves, r.o.x, r.o.y, r.o.z, r.d.x, r.d.y, r.d.z, ray->tmin, hit->t);
                    if (own.prim != BVH_MISS) {
                        *hit = own;
                        found = at;
                    }
                }
            }
        }
        do {
            if (!n) return found;
            entry = entries[--n];
        } while (entry >= hit->t);
        node = tree[waiting[n]];
    }
}

/* The nearest hit, if there is one nearer than h: it becomes that one, in the world. */
inline void instances_closest(global const float *nodes, global const float *leaves, INSTANCE_ARGS, Scene scene,
                              vec3 o, vec3 d, TriHit tri, TraceHit *h)
{
    if (!ray_finite(o.x, o.y, o.z, d.x, d.y, d.z)) return;
    Ray ray = ray_make(o.x, o.y, o.z, d.x, d.y, d.z, 0.0f);
    uint at = instances_trace(nodes, leaves, INSTANCES, scene, &ray, &tri, 0);
    if (at == BVH_MISS) return;
    h->t = tri.t;
    h->u = tri.u;
    h->v = tri.v;
    h->instance = as_int(at) + 1;
    h->prim = as_int(tri.prim) + instance_row_row(scene.instances, as_int(at) * INSTANCE_ROW_WORDS).prim;
    h->shape = as_int(tri.tag);
    h->n = instance_normal(instance_frame(scene, 1, h->instance), v3(tri.nx, tri.ny, tri.nz));
}

inline int instances_occluded(global const float *nodes, global const float *leaves, INSTANCE_ARGS, Scene scene,
                              vec3 o, vec3 d, float t)
{
    if (!ray_finite(o.x, o.y, o.z, d.x, d.y, d.z)) return 0;
    Ray ray = ray_make(o.x, o.y, o.z, d.x, d.y, d.z, 0.0f);
    TriHit tri = tri_miss(t);
    return instances_trace(nodes, leaves, INSTANCES, scene, &ray, &tri, 1) != BVH_MISS;
}
