/* A camera that moves, joined to a point p of the scene, or where `away` to one at infinity in the direction p: both
 * are taken to where the camera was lowered. A solid angle there is |M d|^3 / |det M| of one in the world, M being the
 * motion's matrix and d the direction there; importance counts it per t^2, which is |M d|^2 as much in the world. */

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
