/* A camera that moves, at the time of the path. */

/* Step. */
#include "motion/motion.cl"

inline Motion camera_motion(Scene scene)
{
    return motion_at(scene, (integer)(as_int(scene.distributions[MOTION_ROW + 1])));
}

/* The ray of the camera as it was lowered. */
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

/* Step connect: the camera is joined to a point p of the scene, or where `away` to a point at infinity in the direction
 * p: both are taken to where the camera was lowered. A solid angle there is |M d|^3 / |det M| of the angle in the
 * world, M being the motion's matrix and d the direction there; importance counts it per t^2, which is |M d|^2 as much
 * in the world. */
#include "cameras/motion.cl"

inline vec3 camera_point_back(Motion m, vec3 p, mask away)
{
    vec3 d = motion_back(m, p);
#if MOTION_SCALES
    d = scale3(d, 1.0f / sqrt(max_r(dot3(d, d), (real)(1e-35f))));
#endif
    return sel3(away, d, motion_point_back(m, p));
}

inline CameraPoint camera_point_moved(Motion m, CameraPoint c, mask away)
{
    c.o = motion_point(m, c.o);
    c.d = motion_vector(m, c.d);
#if MOTION_SCALES
    real longer = sqrt(max_r(dot3(c.d, c.d), (real)(1e-35f)));
    real shrinks = fabs(dot3(m.x, cross3(m.y, m.z))); /* 1 / |det M| */
    c.d = scale3(c.d, 1.0f / longer);
    c.t = sel(away, c.t, c.t * longer);
    c.importance *= shrinks * longer * sel(away, sqr(longer), (real)(1.0f));
#endif
    return c;
}

inline CameraPoint camera_connect(Scene scene, vec3 p, mask away, vec2 lens)
{
    Motion motion = camera_motion(scene);
    p = camera_point_back(motion, p, away);
    return camera_point_moved(motion, camera_connect_still(scene, p, away, lens), away);
}

/* Step front: the front of a lens that moves. */
#include "cameras/motion.cl"

inline CameraRay front_moved(Scene scene, CameraRay ray) { return camera_moved(scene, ray); }

/* A direction from the front, as the camera was lowered; *grows: a solid angle there, over that in the world. */
inline vec3 front_lowered(Scene scene, vec3 to, real *grows)
{
    Motion motion = camera_motion(scene);
    to = motion_back(motion, to);
#if MOTION_SCALES
    real longer = 1.0f / sqrt(max_r(dot3(to, to), (real)(1e-35f)));
    to = scale3(to, longer);
    *grows = fabs(dot3(motion.x, cross3(motion.y, motion.z))) * longer * longer * longer;
#endif
    return to;
}

/* Twin, where the camera stands still. */
inline CameraRay front_moved(Scene scene, CameraRay ray) { return ray; }
inline vec3 front_lowered(Scene scene, vec3 to, real *grows) { return to; }

/* Step axis: where the camera is, and along which axis it looks. */
#include "cameras/motion.cl"

inline void camera_axis_moved(Scene scene, vec3 *from, vec3 *axis)
{
    Motion m = camera_motion(scene);
    *from = motion_point(m, *from);
    *axis = motion_vector(m, *axis);
}

/* Twin, where the camera stands still. */
inline void camera_axis_moved(Scene scene, vec3 *from, vec3 *axis) {}
