/* Where a point of a sphere that moves by itself is when the shutter opens and closes, for the layer of motion. */
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
