/* How a point of a triangle moves with coordinates whose values at its corners are ta, tb and tc. */
typedef struct {
    mask regular;    /* the coordinates tell directions */
    vec2 dbdu, dbdv; /* how the barycentrics of the second and third corner move */
    vec3 dpdu, dpdv; /* and the point, in the world [m] */
} UvTangents;

inline UvTangents tangents_of_uv(Scene scene, HitSpace space, Corners c, mask mapped, vec2 ta, vec2 tb, vec2 tc)
{
    UvTangents r;
    vec3 pa = corner_vec3(scene.vertices, c.a, c.keys);
    vec3 e1 = sub3(corner_vec3(scene.vertices, c.b, c.keys), pa);
    vec3 e2 = sub3(corner_vec3(scene.vertices, c.c, c.keys), pa);
    real du1 = tb.x - ta.x, dv1 = tb.y - ta.y, du2 = tc.x - ta.x, dv2 = tc.y - ta.y;
    real det = du1 * dv2 - dv1 * du2;
    r.regular = mapped & (fabs(det) > 1e-20f);
    real inv = 1.0f / sel(r.regular, det, (real)(1.0f));
    r.dbdu.x = dv2 * inv;
    r.dbdu.y = -dv1 * inv;
    r.dbdv.x = -du2 * inv;
    r.dbdv.y = du1 * inv;
    r.dpdu = hit_vector(space, scale3(sub3(scale3(e1, dv2), scale3(e2, dv1)), inv));
    r.dpdv = hit_vector(space, scale3(sub3(scale3(e2, du1), scale3(e1, du2)), inv));
    return r;
}

inline void uv_tangents(Scene scene, HitSpace space, Corners c, mask mapped, vec2 ta, vec2 tb, vec2 tc, Surface *s)
{
    UvTangents r = tangents_of_uv(scene, space, c, mapped, ta, tb, tc);
    s->dpdu = sel3(r.regular, r.dpdu, s->dpdu);
    s->dpdv = sel3(r.regular, r.dpdv, s->dpdv);
    s->along = s->dpdu;
    s->beside = s->dpdv;
    s->dbdu.x = sel(r.regular, r.dbdu.x, s->dbdu.x);
    s->dbdu.y = sel(r.regular, r.dbdu.y, s->dbdu.y);
    s->dbdv.x = sel(r.regular, r.dbdv.x, s->dbdv.x);
    s->dbdv.y = sel(r.regular, r.dbdv.y, s->dbdv.y);
}

/* Twin, where nothing asks for directions along a surface. */
inline void uv_tangents(Scene scene, HitSpace space, Corners c, mask mapped, vec2 ta, vec2 tb, vec2 tc, Surface *s) {}
