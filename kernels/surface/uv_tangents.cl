/* How a point of a triangle moves with its uv, by the uv of its corners ta, tb and tc. */
inline void uv_tangents(Scene scene, HitSpace space, Corners c, mask mapped, vec2 ta, vec2 tb, vec2 tc, Surface *s)
{
    vec3 pa = corner_vec3(scene.vertices, c.a, c.keys);
    vec3 e1 = sub3(corner_vec3(scene.vertices, c.b, c.keys), pa);
    vec3 e2 = sub3(corner_vec3(scene.vertices, c.c, c.keys), pa);
    real du1 = tb.x - ta.x, dv1 = tb.y - ta.y, du2 = tc.x - ta.x, dv2 = tc.y - ta.y;
    real det = du1 * dv2 - dv1 * du2;
    mask regular = mapped & (fabs(det) > 1e-20f);
    real inv = 1.0f / sel(regular, det, (real)(1.0f));
    s->dpdu = sel3(regular, scale3(sub3(scale3(e1, dv2), scale3(e2, dv1)), inv), s->dpdu);
    s->dpdv = sel3(regular, scale3(sub3(scale3(e2, du1), scale3(e1, du2)), inv), s->dpdv);
    s->dpdu = hit_vector(space, s->dpdu);
    s->dpdv = hit_vector(space, s->dpdv);
}
