/* What meshes say per vertex or face, for textures: where a point is among their attributes. */
inline void surface_attributes(Scene scene, ShapeRow shape, integer prim, mask active, Surface *s)
{
    s->attributes = shape.attributes;
    s->face = sel_i(active & (shape.kind == 0), prim, (integer)(0));
#if USES_ANALYTIC
    mask many = active & ((shape.flags & SHAPE_MANY) != 0);
    s->face = sel_i(many, texture_face_of_sphere(prim - scene.settings->single_count), s->face);
#endif
    s->b = s->uv;
}

inline void surface_attributes_tell(Surface s, TexturePoint *t)
{
    t->attributes = s.attributes;
    t->face = s.face;
    t->b = s.b;
}

/* A point that is moved by u and v along the surface. */
inline void surface_attributes_move(Surface s, real u, real v, TexturePoint *t)
{
    t->b.x += s.dbdu.x * u + s.dbdv.x * v;
    t->b.y += s.dbdu.y * u + s.dbdv.y * v;
}

/* Twin, where no texture reads attributes. */
inline void surface_attributes(Scene scene, ShapeRow shape, integer prim, mask active, Surface *s) {}
inline void surface_attributes_tell(Surface s, TexturePoint *t) {}
inline void surface_attributes_move(Surface s, real u, real v, TexturePoint *t) {}
