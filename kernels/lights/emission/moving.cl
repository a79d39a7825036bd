/* Lights that move, for paths that start there. What a light gives as it was lowered is brought to the time. */
#include "motion/motion.cl"

inline LightRay light_ray_moved(Motion m, LightRay r)
{
    r.o = motion_point(m, r.o);
    r.d = motion_vector(m, r.d); /* lamps are not scaled */
    r.n = motion_vector(m, r.n);
    return r;
}

/* How much an area grows, where angles are kept. */
inline real motion_area(Motion m, vec3 n)
{
#if MOTION_SCALES
    return 1.0f / sqr(motion_length_back(m, n));
#else
    return 1.0f;
#endif
}

inline SurfacePoint surface_point_moved(Motion m, SurfacePoint q)
{
    q.p = motion_point(m, q.p);
    q.n = motion_normal(m, q.n);
#if MOTION_SCALES
    q.n = scale3(q.n, 1.0f / sqrt(max_r(dot3(q.n, q.n), (real)(1e-35f))));
#endif
    q.area *= motion_area(m, q.n);
    return q;
}
