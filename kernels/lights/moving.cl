/* Lights that move. A point is taken to where the light was lowered, the light is sampled there, and the sample is
 * brought back. Such a motion keeps angles, so that densities per solid angle stay. */
#include "motion/motion.cl"

inline Motion motion_of_light(Scene scene, integer row, LightRow l)
{
    mask placed = l.shape < 0;
    integer shape = sel_i(placed, (integer)(0), l.shape) * SHAPE_ROW_WORDS;
    integer number = shape_row_row(scene.shapes, shape).number;
    integer of_shape = number + as_int(scene.distributions[MOTION_ROW + 2]);
    integer of_lamp = row + as_int(scene.distributions[MOTION_ROW + 3]);
    return motion_at(scene, motion_word(scene, sel_i(placed, of_lamp, of_shape)));
}

/* A unit vector; 0 stays 0. */
inline vec3 motion_back_unit(Motion m, vec3 v)
{
#if MOTION_SCALES
    vec3 back = motion_back(m, v);
    return scale3(back, 1.0f / sqrt(max_r(dot3(back, back), (real)(1e-20f))));
#else
    return motion_back(m, v);
#endif
}

/* A normal: by the transpose, which is the way back of `motion_normal` where angles are kept. */
inline vec3 motion_front_back(Motion m, vec3 n) { return motion_back_unit(m, n); }

inline LightSample light_moved(Motion m, LightSample s)
{
    s.wi = motion_vector(m, s.wi); /* lamps are not scaled */
    return s;
}

inline ShapeSample area_moved(Motion m, ShapeSample q)
{
    q.wi = motion_vector(m, q.wi);
    q.n = motion_normal(m, q.n);
#if MOTION_SCALES
    real longer = sqrt(max_r(dot3(q.wi, q.wi), (real)(1e-35f)));
    q.wi = scale3(q.wi, 1.0f / longer);
    q.n = normalize3(q.n);
    q.t *= longer;
    q.size *= longer;
#endif
    return q;
}
