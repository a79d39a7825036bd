/* Lights that move. A point is transformed to the space where the light was lowered, the light is sampled there, and
 * the sample is transformed back. Such a motion keeps angles, so densities per solid angle stay. */

/* Step. */
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

/* A normal: by the transpose, the inverse of `motion_normal` where angles are kept. */
inline vec3 motion_front_back(Motion m, vec3 n) { return motion_back_unit(m, n); }

/* A point that a light shines on, in the space where the light was lowered: p, the hemisphere, and direction,
 * distance and normal of a point of the light. */
typedef struct {
    vec3 p, wi, n, hemisphere;
    real t;
    Motion motion;
} LightView;

inline LightView light_view(Scene scene, integer row, LightRow l, vec3 p, vec3 hemisphere)
{
    LightView v;
    v.motion = motion_of_light(scene, row, l);
    v.p = motion_point_back(v.motion, p);
    v.hemisphere = motion_back_unit(v.motion, hemisphere);
    return v;
}

inline LightView light_view_along(LightView v, vec3 wi, real t, vec3 n)
{
    v.t = t * motion_length_back(v.motion, wi);
    v.n = motion_front_back(v.motion, n);
    v.wi = motion_back_unit(v.motion, wi);
    return v;
}

inline vec3 light_view_direction(LightView v, vec3 d) { return motion_back_unit(v.motion, d); }

/* Samples of the light as it was lowered, at the time. */
inline LightSample light_moved(LightView v, LightSample s)
{
    s.wi = motion_vector(v.motion, s.wi); /* lamps are not scaled */
    return s;
}

inline ShapeSample area_moved(LightView v, ShapeSample q)
{
    q.wi = motion_vector(v.motion, q.wi);
    q.n = motion_normal(v.motion, q.n);
#if MOTION_SCALES
    real longer = sqrt(max_r(dot3(q.wi, q.wi), (real)(1e-35f)));
    q.wi = scale3(q.wi, 1.0f / longer);
    q.n = normalize3(q.n);
    q.t *= longer;
    q.size *= longer;
#endif
    return q;
}

/* Twin, where no light moves. */
typedef struct { vec3 p, wi, n, hemisphere; real t; } LightView;

inline LightView light_view(Scene scene, integer row, LightRow l, vec3 p, vec3 hemisphere)
{
    LightView v = {p};
    v.hemisphere = hemisphere;
    return v;
}
inline LightView light_view_along(LightView v, vec3 wi, real t, vec3 n)
{
    return (LightView){v.p, wi, n, v.hemisphere, t};
}
inline vec3 light_view_direction(LightView v, vec3 d) { return d; }
inline LightSample light_moved(LightView v, LightSample s) { return s; }
inline ShapeSample area_moved(LightView v, ShapeSample q) { return q; }

/* Step deforming: lights whose triangles deform. `geometry` has a row of such a triangle for each key, side by side.
 * Between keys rows are linear, as vertices are (motion/motion.cl). */
#include "motion/motion.cl"
#include "motion/motion.cl#vertex_keys"

inline Triangle triangle_then(Scene scene, LightRow l, mask active)
{
    integer row = sel_i(active & (l.shape >= 0), l.shape, (integer)(0)) * SHAPE_ROW_WORDS;
    ShapeRow shape = shape_row_row(scene.shapes, row);
    mask deforms = active & ((shape.flags & SHAPE_DEFORMS) != 0);
    integer at = sel_i(active, l.params, (integer)(0));
    Triangle s = triangle_row(scene.geometry, at);
    if (any(deforms)) {
        VertexKeys k = vertex_keys(scene, sel_i(deforms, shape.number, (integer)(0)), scene.time);
        integer first = at + sel_i(deforms, k.key * TRIANGLE_ROW_WORDS, (integer)(0));
        Triangle a = triangle_row(scene.geometry, first);
        Triangle b = triangle_row(scene.geometry, first + sel_i(deforms, k.next * TRIANGLE_ROW_WORDS, (integer)(0)));
        real share = sel(deforms, k.share, (real)(0.0f));
        s.v0 = madd3(a.v0, 1.0f - share, scale3(b.v0, share));
        s.e1 = madd3(a.e1, 1.0f - share, scale3(b.e1, share));
        s.e2 = madd3(a.e2, 1.0f - share, scale3(b.e2, share));
    }
    return s;
}

/* Step emission: rays from lights that move: rays from the light as it was lowered are transformed to the time. */
#include "motion/motion.cl"

inline LightRay light_ray_moved(LightView v, LightRay r)
{
    Motion m = v.motion;
    r.o = motion_point(m, r.o);
    r.d = motion_vector(m, r.d); /* lamps are not scaled */
    r.n = motion_vector(m, r.n);
    return r;
}

/* The factor of an area, where angles are kept. */
inline real motion_area(Motion m, vec3 n)
{
#if MOTION_SCALES
    return 1.0f / sqr(motion_length_back(m, n));
#else
    return 1.0f;
#endif
}

inline SurfacePoint surface_point_moved(LightView v, SurfacePoint q)
{
    Motion m = v.motion;
    q.p = motion_point(m, q.p);
    q.n = motion_normal(m, q.n);
#if MOTION_SCALES
    q.n = scale3(q.n, 1.0f / sqrt(max_r(dot3(q.n, q.n), (real)(1e-35f))));
#endif
    q.area *= motion_area(m, q.n);
    return q;
}

/* Twin, where no light moves. */
inline LightRay light_ray_moved(LightView v, LightRay r) { return r; }
inline SurfacePoint surface_point_moved(LightView v, SurfacePoint q) { return q; }
