/* The space of a hit triangle, which its instance transforms to the world. */
#include "tracing/instances.cl"

typedef struct {
    mask placed; /* by an instance */
    InstanceFrame frame;
} HitSpace;

/* Step. */

inline void hit_space_load(TraceHit *h, Slab hit, uint at) { h->instance = load_hit_instance(hit, at); }

inline HitSpace hit_space(Scene scene, TraceHit h, mask active)
{
    HitSpace s;
    s.placed = active & (h.instance > 0);
    s.frame = instance_frame(scene, s.placed, h.instance);
    return s;
}

inline vec3 hit_normal(HitSpace s, vec3 n) { return sel3(s.placed, instance_normal(s.frame, n), n); }
inline vec3 hit_vector(HitSpace s, vec3 v) { return sel3(s.placed, instance_vector(s.frame, v), v); }

/* Twin, in a scene without instances, where triangles lie in the world. */
inline void hit_space_load(TraceHit *h, Slab hit, uint at) {}
inline HitSpace hit_space(Scene scene, TraceHit h, mask active) { HitSpace s = {mask_of(0)}; return s; }
inline vec3 hit_normal(HitSpace s, vec3 n) { return n; }
inline vec3 hit_vector(HitSpace s, vec3 v) { return v; }
