/* Directions along a surface as its mesh tells them: tangents of vertices, which with the normal give the other one.
 * They hold for all sets of uv. */

inline void triangle_tangents(Scene scene, ShapeRow shape, HitSpace space, Corners c, Surface *s)
{
    mask told = c.smooth & ((shape.flags & SHAPE_TANGENTS) != 0);
    if (any(told)) {
        integer first = (integer)(VERTEX_TANGENTS);
        vec4 qa = gather4(scene.distributions, first + 4 * c.a), qb = gather4(scene.distributions, first + 4 * c.b);
        vec4 qc = gather4(scene.distributions, first + 4 * c.c);
        vec3 along = madd3(v3(qa.x, qa.y, qa.z), c.w, madd3(v3(qb.x, qb.y, qb.z), c.u,
                           scale3(v3(qc.x, qc.y, qc.z), c.v)));
        vec3 beside = scale3(cross3(c.normal, along), sel(qa.w < 0.0f, (real)(-1.0f), (real)(1.0f)));
        along = hit_vector(space, along);
        beside = hit_vector(space, beside);
        told = told & (dot3(beside, beside) > 1e-12f);
        s->told = told;
        s->along = sel3(told, along, s->along);
        s->beside = sel3(told, beside, s->beside);
        s->along1 = sel3(told, along, s->along1);
        s->beside1 = sel3(told, beside, s->beside1);
    }
}

/* Twin, where no mesh has tangents, or nothing asks for them. */
inline void triangle_tangents(Scene scene, ShapeRow shape, HitSpace space, Corners c, Surface *s) {}
