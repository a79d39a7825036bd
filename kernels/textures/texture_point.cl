/* What a texture may look at: every loader of parameters gets it. What a scene's textures do not ask for
 * is never computed. USES_ATTRIBUTES: some texture reads what a mesh says per vertex or face. STOCHASTIC_FILTERING:
 * a random texel stands for some parameter of the material; TEXELS_AT_RANDOM: of some material of a loop. */
typedef struct {
    vec2 uv;
    vec3 p; /* in the world [m] */
#if USES_ATTRIBUTES
    integer attributes; /* of the mesh: first word in `attributes` of where each of them lies; 0: it has none */
    integer face;       /* of `faces`; below 0: of a sphere, see texture_face_of_sphere */
    vec2 b;             /* barycentrics of its vertices 1 and 2 */
#endif
#if STOCHASTIC_FILTERING || TEXELS_AT_RANDOM
    vec2 u; /* uniform numbers, which choose the texel */
#endif
    real footprint; /* how wide what is looked at is, in units of uv; 0: a point */
} TexturePoint;

/* `face` for row `sphere` of `spheres`, whose attributes are the same all over it. */
inline integer texture_face_of_sphere(integer sphere) { return -1 - sphere; }

/* Which row of an attribute holds for a corner of a face; there, a sphere stands for its three corners. */
inline integer texture_corner(Scene scene, TexturePoint point, int corner)
{
    mask ball = point.face < 0;
    integer vertex = gather_i(scene.faces, sel_i(ball, (integer)(0), 3 * point.face + corner));
    return sel_i(ball, -1 - point.face, vertex);
}

inline TexturePoint texture_point(vec2 uv, vec3 p)
{
    TexturePoint t;
    t.uv = uv;
    t.p = p;
#if USES_ATTRIBUTES
    t.attributes = 0;
    t.face = 0;
    t.b.x = 0.0f;
    t.b.y = 0.0f;
#endif
#if STOCHASTIC_FILTERING || TEXELS_AT_RANDOM
    t.u.x = 0.0f;
    t.u.y = 0.0f;
#endif
    t.footprint = 0.0f;
    return t;
}
/* For values without a surface. */
inline TexturePoint texture_point_nowhere(void)
{
    vec2 uv = {0.0f, 0.0f};
    return texture_point(uv, v3(0.0f, 0.0f, 0.0f));
}
inline TexturePoint texture_point_sel(mask m, TexturePoint a, TexturePoint b)
{
    a.uv.x = sel(m, a.uv.x, b.uv.x);
    a.uv.y = sel(m, a.uv.y, b.uv.y);
    a.p = sel3(m, a.p, b.p);
#if USES_ATTRIBUTES
    a.attributes = sel_i(m, a.attributes, b.attributes);
    a.face = sel_i(m, a.face, b.face);
    a.b.x = sel(m, a.b.x, b.b.x);
    a.b.y = sel(m, a.b.y, b.b.y);
#endif
    a.footprint = sel(m, a.footprint, b.footprint);
    return a;
}
