/* The space in which a hit triangle lies, that of its instance, and the way from there to the world. */
#include "generated/instances.cl"

typedef struct {
    mask placed; /* by an instance */
    InstanceFrame frame;
} HitSpace;

#define hit_space_load(h, hit, at) (h).instance = load_hit_instance(hit, at)

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
typedef integer HitSpace;
#define hit_space_load(h, hit, at)
#define hit_space(scene, h, active) ((integer)(0))
#define hit_normal(space, n) (n)
#define hit_vector(space, v) (v)
