/* Directions along an analytic shape. */
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
