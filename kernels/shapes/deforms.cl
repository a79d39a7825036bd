/* Where a point of a mesh that deforms is when the shutter opens and closes, for the layer of motion. */
inline void surface_deforms(Scene scene, ShapeRow shape, HitSpace space, integer prim, mask active, TraceHit h,
                            Surface *s)
{
    mask deforms = active & ((shape.flags & SHAPE_DEFORMS) != 0);
    if (any(deforms)) {
        integer number = sel_i(deforms, shape.number, (integer)(0)), face = sel_i(deforms, prim, (integer)(0));
        global const float *shutter = scene.distributions + as_int(scene.distributions[MOTION_ROW]);
        vec3 now = vertex_point(scene, number, face, h.u, h.v, scene.time);
        vec3 first = sub3(vertex_point(scene, number, face, h.u, h.v, (real)(shutter[1])), now);
        vec3 last = sub3(vertex_point(scene, number, face, h.u, h.v, (real)(shutter[1] + shutter[2])), now);
        s->to_open = sel3(deforms, hit_vector(space, first), s->to_open);
        s->to_close = sel3(deforms, hit_vector(space, last), s->to_close);
    }
}

/* Twin, where nothing deforms, or no layer tells how. */
inline void surface_deforms(Scene scene, ShapeRow shape, HitSpace space, integer prim, mask active, TraceHit h,
                            Surface *s) {}
