/* Directions along a surface as its mesh tells them: tangents of vertices, which with the normal give the other one. */

/* The direction of `along`, as long as `other`; of unit length where that has none. */
inline vec3 tangent_of_length(vec3 along, vec3 other)
{
    real length2 = dot3(other, other);
    return scale3(along, sqrt(sel(length2 > 0.0f, length2, (real)(1.0f)) / max_r(dot3(along, along), (real)(1e-30f))));
}

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
        s->dpdu = sel3(told, tangent_of_length(along, s->dpdu), s->dpdu);
        s->dpdv = sel3(told, tangent_of_length(beside, s->dpdv), s->dpdv);
    }
}
