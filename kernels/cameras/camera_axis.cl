/* Where a camera that moves is at the time of the path, and along which axis it looks. */
#include "motion/motion.cl"

inline void camera_axis_moved(Scene scene, vec3 *from, vec3 *axis)
{
    Motion m = motion_at(scene, (integer)(as_int(scene.distributions[MOTION_ROW + 1])));
    *from = motion_point(m, *from);
    *axis = motion_vector(m, *axis);
}

/* Twin, where the camera stands still. */
inline void camera_axis_moved(Scene scene, vec3 *from, vec3 *axis) {}
