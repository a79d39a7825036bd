/* A camera that moves: its ray as it was lowered, at the time of the path. */
#include "motion/motion.cl"

inline Motion camera_motion(Scene scene)
{
    return motion_at(scene, (integer)(as_int(scene.distributions[MOTION_ROW + 1])));
}

inline CameraRay camera_moved(Scene scene, CameraRay ray)
{
    Motion m = camera_motion(scene);
    ray.o = motion_point(m, ray.o);
    ray.d = motion_vector(m, ray.d);
#if MOTION_SCALES
    real longer = sqrt(max_r(dot3(ray.d, ray.d), (real)(1e-35f)));
    ray.d = scale3(ray.d, 1.0f / longer);
    ray.far = sel(ray.far < FAR, ray.far * longer, ray.far);
#endif
    return ray;
}
