/* Transforms from a group's space to the world by an InstanceRow; x, y and z are the rows of the inverse, the matrix
 * from the world to the group. Rows are scaled first, so that tiny and huge instances stay in float's range. */
#include "generated/motion.cl"

typedef struct { vec3 x, y, z, origin; real scale; } InstanceFrame;

inline real instance_size(vec3 v) { return fabs(v.x) + fabs(v.y) + fabs(v.z); }

inline InstanceFrame instance_frame(Scene scene, mask placed, integer instance)
{
    integer row = sel_i(placed, instance - 1, (integer)(0)) * INSTANCE_ROW_WORDS;
    InstanceRow i = instance_row_row(scene.instances, row);
#if MOVES_INSTANCES
    i = motion_of_instance(scene, i);
#endif
    real size = instance_size(i.x) + instance_size(i.y) + instance_size(i.z), scale = 1.0f / size;
    InstanceFrame f = {scale3(i.x, scale), scale3(i.y, scale), scale3(i.z, scale), i.origin, scale};
    return f;
}

/* A normal, by the inverse transpose, which keeps the front side but not the length. */
inline vec3 instance_normal(InstanceFrame f, vec3 n) { return madd3(f.x, n.x, madd3(f.y, n.y, scale3(f.z, n.z))); }

/* A vector, by the inverse (Cramer's rule). */
inline vec3 instance_vector(InstanceFrame f, vec3 v)
{
    vec3 yz = cross3(f.y, f.z);
    vec3 sum = madd3(yz, v.x, madd3(cross3(f.z, f.x), v.y, scale3(cross3(f.x, f.y), v.z)));
    return scale3(sum, f.scale / dot3(f.x, yz));
}

/* About the greatest length of a transformed unit vector. */
inline real instance_stretch(InstanceFrame f)
{
    vec3 yz = cross3(f.y, f.z);
    real sum = instance_size(yz) + instance_size(cross3(f.z, f.x)) + instance_size(cross3(f.x, f.y));
    return sum * fabs(f.scale / dot3(f.x, yz));
}
