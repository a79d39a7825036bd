/* The front of a lens that moves. */
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
