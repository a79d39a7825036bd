/* Directions along the second set of uv of a mesh, which are the attributes vertex_u1 and vertex_v1. */

/* Such an attribute at the corners of a triangle; number: its index in the directory of the mesh. */
inline vec3 second_uv_corners(Scene scene, ShapeRow shape, Corners c, integer number)
{
    integer entry = sel_i(c.triangle, shape.attributes + 2 * number, (integer)(0));
    integer first = gather_i(scene.attributes, entry), words = gather_i(scene.attributes, entry + 1);
    return v3(gather_w(scene.attributes, first + words * c.a), gather_w(scene.attributes, first + words * c.b),
              gather_w(scene.attributes, first + words * c.c));
}

inline void triangle_second_uv(Scene scene, ShapeRow shape, HitSpace space, Corners c, Surface *s)
{
    mask has = c.triangle & (shape.attributes != 0) & mask_of(scene.settings->second_u >= 0);
    if (any(has)) {
        vec3 u = second_uv_corners(scene, shape, c, (integer)(max(scene.settings->second_u, 0)));
        vec3 v = second_uv_corners(scene, shape, c, (integer)(max(scene.settings->second_v, 0)));
        vec2 ta = {u.x, v.x}, tb = {u.y, v.y}, tc = {u.z, v.z};
        UvTangents r = tangents_of_uv(scene, space, c, has, ta, tb, tc);
        s->along1 = sel3(r.regular, r.dpdu, s->along1);
        s->beside1 = sel3(r.regular, r.dpdv, s->beside1);
    }
}

/* Twin, where no map lies on a second set of uv. */
inline void triangle_second_uv(Scene scene, ShapeRow shape, HitSpace space, Corners c, Surface *s) {}
