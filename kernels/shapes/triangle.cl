/* A point of a triangle by the data of its mesh: shading normal, uv, and directions along uv. */

#include "generated/corner_rows.cl"

/* The corners of a triangle, and where between them a point lies. */
typedef struct {
    mask triangle;
    integer a, b, c; /* the vertices */
    real u, v, w;    /* barycentrics of b, c and a */
    CornerKeys keys; /* see still_rows and keyed_rows */
    mask smooth;     /* the mesh has normals */
    vec3 normal;     /* interpolated, in the space of the mesh; of any length */
} Corners;

inline Corners corners_of(Scene scene, ShapeRow shape, integer prim, mask active, vec2 uv)
{
    Corners c;
    c.triangle = active & (shape.kind == 0);
    integer corner = sel_i(c.triangle, prim, (integer)(0)) * 3;
    vec3 corners = gather3((global const float *)scene.faces, corner);
    c.a = as_integer(corners.x);
    c.b = as_integer(corners.y);
    c.c = as_integer(corners.z);
    c.u = uv.x;
    c.v = uv.y;
    c.w = 1.0f - uv.x - uv.y;
    c.keys = corner_keys(scene, shape, active);
    c.smooth = c.triangle & ((shape.flags & SHAPE_NORMALS) != 0);
    c.normal = v3(0.0f, 0.0f, 0.0f);
    return c;
}

#include "generated/triangle_steps.cl"

inline void surface_triangle(Scene scene, ShapeRow shape, HitSpace space, integer prim, mask active, Surface *s)
{
    Corners c = corners_of(scene, shape, prim, active, s->uv);
    triangle_normal(scene, space, &c, s);
    triangle_uv(scene, shape, space, c, s);
    triangle_second_uv(scene, shape, space, c, s);
    triangle_tangents(scene, shape, space, c, s);
}

/* Twin, where no mesh has normals, uv or tangents. */
inline void surface_triangle(Scene scene, ShapeRow shape, HitSpace space, integer prim, mask active, Surface *s) {}

/* Step still_rows: rows of three floats of a vertex, of meshes that keep their form. */
typedef integer CornerKeys;
#define corner_keys(scene, shape, active) ((integer)(0))
#define corner_vec3(table, vertex, keys) gather3(table, (vertex) * 3)

/* Step keyed_rows: rows of three floats of a vertex, where some meshes deform: at the scene's time. */
typedef VertexKeys CornerKeys;
#define corner_vec3(table, vertex, keys) vertex_keyed(table, vertex, keys)

/* The keys of a shape's vertices at the scene's time; the first key where it does not deform. */
inline VertexKeys corner_keys(Scene scene, ShapeRow shape, mask active)
{
    mask deforms = active & ((shape.flags & SHAPE_DEFORMS) != 0);
    VertexKeys still = {(integer)(1), (integer)(0), (integer)(0), (real)(0.0f)};
    if (!any(deforms)) return still;
    VertexKeys k = vertex_keys(scene, sel_i(deforms, shape.number, (integer)(0)), scene.time);
    k.count = sel_i(deforms, k.count, still.count);
    k.key = sel_i(deforms, k.key, still.key);
    k.next = sel_i(deforms, k.next, still.next);
    k.share = sel(deforms, k.share, still.share);
    return k;
}

/* Step normal: the shading normal of a triangle whose mesh has normals. */
inline void triangle_normal(Scene scene, HitSpace space, Corners *c, Surface *s)
{
    if (any(c->smooth)) {
        vec3 a = corner_vec3(scene.normals, c->a, c->keys), b = corner_vec3(scene.normals, c->b, c->keys);
        vec3 ns = madd3(a, c->w, madd3(b, c->u, scale3(corner_vec3(scene.normals, c->c, c->keys), c->v)));
        mask usable = c->smooth & (dot3(ns, ns) > 1e-12f);
        c->normal = ns;
        s->ns = sel3(usable, normalize3(hit_normal(space, ns)), s->ns);
    }
}

/* Twin, in a scene whose meshes have no normals. */
inline void triangle_normal(Scene scene, HitSpace space, Corners *c, Surface *s) {}

/* Step uv: the uv of a point of a triangle, and the derivatives of the point by uv. */
#include "generated/uv_tangents.cl"

inline void triangle_uv(Scene scene, ShapeRow shape, HitSpace space, Corners c, Surface *s)
{
    mask mapped = c.triangle & ((shape.flags & SHAPE_UVS) != 0);
    if (any(mapped)) {
        vec2 ta = gather2(scene.uvs, c.a * 2), tb = gather2(scene.uvs, c.b * 2), tc = gather2(scene.uvs, c.c * 2);
        s->uv.x = sel(mapped, ta.x * c.w + tb.x * c.u + tc.x * c.v, s->uv.x);
        s->uv.y = sel(mapped, ta.y * c.w + tb.y * c.u + tc.y * c.v, s->uv.y);
        uv_tangents(scene, space, c, mapped, ta, tb, tc, s);
    }
}

/* Twin, where no mesh has uv. */
inline void triangle_uv(Scene scene, ShapeRow shape, HitSpace space, Corners c, Surface *s) {}

/* Step uv_tangents: derivatives of a point of a triangle by coordinates with the values ta, tb and tc at its
 * corners. */
typedef struct {
    mask regular;    /* the coordinates are not degenerate */
    vec2 dbdu, dbdv; /* derivatives of the barycentrics of the second and third corner */
    vec3 dpdu, dpdv; /* and of the point, in the world [m] */
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

/* Twin, where no material uses directions along a surface. */
inline void uv_tangents(Scene scene, HitSpace space, Corners c, mask mapped, vec2 ta, vec2 tb, vec2 tc, Surface *s) {}

/* Step second_uv: directions along the second set of uv of a mesh, which are the attributes vertex_u1 and vertex_v1. */

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

/* Step tangents: directions along a surface from the mesh's vertex tangents; the bitangent follows from the normal.
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

/* Twin, where no mesh has tangents, or no material uses them. */
inline void triangle_tangents(Scene scene, ShapeRow shape, HitSpace space, Corners c, Surface *s) {}
