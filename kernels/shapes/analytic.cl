/* The point of an analytic shape: onto_of_shape, size_of_shape, dpdu_of_shape and dpdv_of_shape are generated for the
 * kinds of the scene. `rest`: the point on the shape as it was lowered. */
#include "generated/analytic_steps.cl"

/* end: of the ray. */
inline void surface_analytic(Scene scene, ShapeRow shape, integer prim, mask active, vec3 end, Surface *s)
{
    mask analytic = active & (shape.kind != 0);
    if (any(analytic)) {
        Motion motion = shape_motion(scene, shape);
        vec3 rest = onto_of_shape(scene, shape, prim, shape_point_back(motion, end));
        s->p = sel3(analytic, shape_point(motion, rest), s->p);
        spheres_move(scene, shape, prim, analytic, motion, rest, s);
        s->size = sel(analytic, size_of_shape(scene, shape, prim) + shape_motion_size(motion, rest), s->size);
        analytic_tangents(scene, shape, prim, analytic, motion, rest, s);
    }
}

/* Twin, where all shapes are triangles. */
inline void surface_analytic(Scene scene, ShapeRow shape, integer prim, mask active, vec3 end, Surface *s) {}

/* Step tangents: directions along an analytic shape. */
inline void analytic_tangents(Scene scene, ShapeRow shape, integer prim, mask analytic, Motion motion, vec3 rest,
                              Surface *s)
{
    vec3 dpdu = dpdu_of_shape(scene, shape, prim, rest, s->uv), dpdv = dpdv_of_shape(scene, shape, prim, rest, s->uv);
    s->dpdu = sel3(analytic, shape_vector(motion, dpdu), s->dpdu);
    s->dpdv = sel3(analytic, shape_vector(motion, dpdv), s->dpdv);
    s->along = sel3(analytic, s->dpdu, s->along);
    s->beside = sel3(analytic, s->dpdv, s->beside);
}

/* Twin, where nothing asks for directions along a surface. */
inline void analytic_tangents(Scene scene, ShapeRow shape, integer prim, mask analytic, Motion motion, vec3 rest,
                              Surface *s) {}

/* Step motion: how a shape has moved since it was lowered. */
inline Motion shape_motion(Scene scene, ShapeRow shape) { return motion_of_shape(scene, shape.number); }
inline vec3 shape_point(Motion m, vec3 p) { return motion_point(m, p); }
inline vec3 shape_point_back(Motion m, vec3 p) { return motion_point_back(m, p); }
inline vec3 shape_vector(Motion m, vec3 v) { return motion_vector(m, v); }

/* Rounding of the transform to the lowered shape and back, as a primitive's size [m]. */
inline real shape_motion_size(Motion m, vec3 rest) { return 4.0f * (size3(m.t) + size3(shape_vector(m, rest))); }

/* Twin, where shapes stand still. */
inline Motion shape_motion(Scene scene, ShapeRow shape)
{
    vec3 zero = v3(0.0f, 0.0f, 0.0f);
    return (Motion){zero, zero, zero, zero};
}
inline vec3 shape_point(Motion m, vec3 p) { return p; }
inline vec3 shape_point_back(Motion m, vec3 p) { return p; }
inline vec3 shape_vector(Motion m, vec3 v) { return v; }
inline real shape_motion_size(Motion m, vec3 rest) { return (real)(0.0f); }

/* Step spheres_move: where a point of a sphere that moves by itself is when the shutter opens and closes, for the
 * layer of motion. */
inline void spheres_move(Scene scene, ShapeRow shape, integer prim, mask analytic, Motion motion, vec3 rest,
                         Surface *s)
{
    mask spheres = analytic & ((shape.flags & SHAPE_MANY) != 0);
    global const float *opens = scene.distributions + as_int(scene.distributions[MOTION_ROW]);
    vec3 first = spheres_way(scene, shape, prim, spheres, rest, (real)(opens[1]));
    vec3 last = spheres_way(scene, shape, prim, spheres, rest, (real)(opens[1] + opens[2]));
    s->to_open = sel3(spheres, shape_vector(motion, first), s->to_open);
    s->to_close = sel3(spheres, shape_vector(motion, last), s->to_close);
}

/* Twin, where spheres do not move by themselves, or no layer tells how. */
inline void spheres_move(Scene scene, ShapeRow shape, integer prim, mask analytic, Motion motion, vec3 rest,
                         Surface *s) {}

/* Step keyed_spheres: spheres of a single shape that move individually. Each has a row of `spheres` for every key, side
 * by side, and its centre and radius are linear in between. The word SPHERES_FIRST behind `params` of `geometry` is the
 * place of primitive 0 in `spheres`. Shapes that do not deform have a single row for each sphere. */

/* The sphere that is primitive `prim` at a time [s], where `active`; number: of the scene's shape. */
inline Sphere spheres_then(Scene scene, integer params, integer prim, integer number, real time, mask active)
{
    VertexKeys k = vertex_keys(scene, number, time);
    Sphere q = sphere_row(scene.geometry, params);
    integer first = gather_i(scene.geometry, params + SPHERES_FIRST);
    integer at = sel_i(active, first + 4 * (k.count * prim + k.key), (integer)(0));
    vec4 a = gather4(scene.spheres, at), b = gather4(scene.spheres, sel_i(active, at + 4 * k.next, (integer)(0)));
    real rest = 1.0f - k.share;
    q.center = madd3(v3(a.x, a.y, a.z), rest, scale3(v3(b.x, b.y, b.z), k.share));
    q.radius = a.w * rest + b.w * k.share;
    return q;
}

/* From a point p of a sphere at the scene's time to the same point at another time, where `active` [m]. */
inline vec3 spheres_way(Scene scene, ShapeRow shape, integer prim, mask active, vec3 p, real time)
{
    integer params = sel_i(active, shape.params, (integer)(0)), number = sel_i(active, shape.number, (integer)(0));
    Sphere now = spheres_then(scene, params, prim, number, scene.time, active);
    Sphere then = spheres_then(scene, params, prim, number, time, active);
    real grown = then.radius / now.radius - 1.0f;
    return madd3(sub3(p, now.center), grown, sub3(then.center, now.center));
}

/* Step hit: intersects the analytic shape of a row, equal in all lanes; shape_case is generated. */
inline ShapeHit shape_hit(Scene scene, int prim, int row, vec3 o, vec3 d, real tmin, real tmax)
{
    return shape_case(scene, prim, scene.shapes + row * SHAPE_ROW_WORDS, o, d, tmin, tmax);
}

/* Step moving_hit: the same for shapes that move: the ray is transformed to the shape as it was lowered. */
inline ShapeHit shape_hit(Scene scene, int prim, int row, vec3 o, vec3 d, real tmin, real tmax)
{
    global const uint *shape = scene.shapes + row * SHAPE_ROW_WORDS;
    Motion motion = motion_of_shape(scene, (integer)((int)shape[SHAPE_ROW_NUMBER]));
    real longer = motion_length_back(motion, d);
    tmax = min_r(tmax * longer, (real)(FAR));
    o = motion_point_back(motion, o);
    d = scale3(motion_back(motion, d), 1.0f / longer);
    ShapeHit h = shape_case(scene, prim, shape, o, d, tmin * longer, tmax);
    h.t = sel(h.t < tmax, h.t / longer, (real)(FAR));
    h.n = normalize3(motion_normal(motion, h.n));
    return h;
}
