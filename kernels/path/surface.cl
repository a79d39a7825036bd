/* The point of a surface that a ray hit, with all that shading asks for. */
#include "core/rounding.cl"
#include "path/surface_flags.cl"
#include "tracing/trace_hit.cl"
#include "generated/instances.cl"
#include "generated/motion.cl"

typedef struct {
    vec3 p;       /* on it, but for the rounding of p itself [m] */
    real size;    /* of the primitive [m], see core/rounding.cl */
    vec3 n;       /* geometric normal, unit length, on the side of the front */
    vec3 ns;      /* shading normal, unit length */
    vec3 dpdu;    /* along the surface's u; not normalised, may be zero */
    vec3 dpdv;    /* and along v */
    vec2 uv;
    mask flipped; /* the back of a two-sided surface was hit, and ns negated */
    integer light; /* row in `lights`, -1: does not emit */
#if USES_ATTRIBUTES
    integer attributes, face; /* of triangles, see texturing/texture_point.cl */
    vec2 b;
#endif
    real footprint; /* of the path's cone, see texturing/texture_point.cl */
#if SCREEN_MOTION && (MOVES_VERTICES || MOVES_SPHERES)
    vec3 to_open, to_close; /* from p to where what deforms has the point when the shutter opens, closes [m] */
#endif
} Surface;

inline vec3 vertex_vec3(global const float *table, integer vertex)
{
    return gather3(table, vertex * 3);
}
inline vec2 vertex_vec2(global const float *table, integer vertex) { return gather2(table, vertex * 2); }

#if MOVES_VERTICES
/* The rows of a shape's vertices at the time; the first where it does not deform. */
inline VertexKeys vertex_keys_of(Scene scene, ShapeRow shape, mask active)
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
#endif

#if VERTEX_TANGENTS
/* The direction of `along`, as long as `other`; of unit length where that has none. */
inline vec3 tangent_of_length(vec3 along, vec3 other)
{
    real length2 = dot3(other, other);
    return scale3(along, sqrt(sel(length2 > 0.0f, length2, (real)(1.0f)) / max_r(dot3(along, along), (real)(1e-30f))));
}
#endif

/* The surface where the ray from `o` along `d` ends. `front` tells which side was hit. A two-sided
 * back has its normals negated, so that the BSDF sees a front. USES_NORMALS, USES_UVS and USES_TANGENTS say
 * what the scene needs; onto_of_shape, size_of_shape, dpdu_of_shape and dpdv_of_shape are generated for its analytic
 * shapes. */
inline Surface surface_at(Scene scene, TraceHit h, mask active, vec3 o, vec3 d, mask *front)
{
    Surface s;
    ShapeRow shape = shape_row_row(scene.shapes, sel_i(active, h.shape, (integer)(0)) * SHAPE_ROW_WORDS);
    vec3 n = sel3(active, h.n, v3(0.0f, 0.0f, 1.0f));
    real inverse = 1.0f / wide_length3(n);
    s.n = scale3(n, inverse);
    s.size = triangle_size(h.side, inverse);
    /* The ray's roundings grow with its length. They may have put its end behind the surface, so that it is put back
     * on it, or behind a neighbour, so that it goes back along the ray first, but not behind its beginning. */
    s.p = madd3(d, max_r(h.t - 2.0f * rounding_step(o, h.t), 0.5f * h.t), o);
    s.p = madd3(s.n, h.plane * inverse - dot3(s.n, s.p), s.p);
    s.ns = s.n;
    s.uv.x = h.u;
    s.uv.y = h.v;
    s.dpdu = v3(0.0f, 0.0f, 0.0f);
    s.dpdv = v3(0.0f, 0.0f, 0.0f);
    s.light = -1;
    integer prim = sel_i(active, h.prim, (integer)(0));
    s.footprint = 0.0f;
#if USES_ATTRIBUTES
    s.attributes = shape.attributes;
    s.face = sel_i(active & (shape.kind == 0), prim, (integer)(0));
#if USES_ANALYTIC
    mask many = active & ((shape.flags & SHAPE_MANY) != 0);
    s.face = sel_i(many, texture_face_of_sphere(prim - scene.settings->single_count), s.face);
#endif
    s.b = s.uv;
#endif
#if USES_INSTANCES
    mask placed = active & (h.instance > 0);
    InstanceFrame space = instance_frame(scene, placed, h.instance);
#endif
#if SCREEN_MOTION && (MOVES_VERTICES || MOVES_SPHERES)
    s.to_open = v3(0.0f, 0.0f, 0.0f);
    s.to_close = s.to_open;
#endif
#if SCREEN_MOTION && MOVES_VERTICES
    mask deforms = active & ((shape.flags & SHAPE_DEFORMS) != 0);
    if (any(deforms)) {
        integer number = sel_i(deforms, shape.number, (integer)(0)), face = sel_i(deforms, prim, (integer)(0));
        global const float *shutter = scene.distributions + as_int(scene.distributions[MOTION_ROW]);
        vec3 now = vertex_point(scene, number, face, h.u, h.v, scene.time);
        vec3 first = sub3(vertex_point(scene, number, face, h.u, h.v, (real)(shutter[1])), now);
        vec3 last = sub3(vertex_point(scene, number, face, h.u, h.v, (real)(shutter[1] + shutter[2])), now);
#if USES_INSTANCES
        first = sel3(placed, instance_vector(space, first), first);
        last = sel3(placed, instance_vector(space, last), last);
#endif
        s.to_open = sel3(deforms, first, s.to_open);
        s.to_close = sel3(deforms, last, s.to_close);
    }
#endif
    mask emits = active & (shape.light >= 0);
    if (any(emits)) {
        integer offset = sel_i((shape.flags & SHAPE_ONE_LIGHT) != 0, (integer)(0), prim - shape.prim);
        s.light = sel_i(emits, shape.light + offset, (integer)(-1));
    }
#if USES_NORMALS || USES_UVS || USES_TANGENTS
    mask triangle = active & (shape.kind == 0);
    integer corner = sel_i(triangle, prim, (integer)(0)) * 3;
    vec3 corners = gather3((global const float *)scene.faces, corner);
    integer a = as_integer(corners.x), b = as_integer(corners.y), c = as_integer(corners.z);
    real u = s.uv.x, v = s.uv.y, w = 1.0f - u - v;
#endif
#if MOVES_VERTICES && (USES_NORMALS || USES_TANGENTS)
    VertexKeys keys = vertex_keys_of(scene, shape, active);
#define VERTEX_VEC3(table, vertex) vertex_keyed(table, vertex, keys)
#else
#define VERTEX_VEC3(table, vertex) vertex_vec3(table, vertex)
#endif
#if USES_NORMALS
    mask smooth = triangle & ((shape.flags & SHAPE_NORMALS) != 0);
#if VERTEX_TANGENTS
    vec3 own_normal = v3(0.0f, 0.0f, 0.0f);
#endif
    if (any(smooth)) {
        vec3 ns = madd3(VERTEX_VEC3(scene.normals, a), w,
                        madd3(VERTEX_VEC3(scene.normals, b), u, scale3(VERTEX_VEC3(scene.normals, c), v)));
        mask usable = smooth & (dot3(ns, ns) > 1e-12f);
#if VERTEX_TANGENTS
        own_normal = ns;
#endif
#if USES_INSTANCES
        ns = sel3(placed, instance_normal(space, ns), ns);
#endif
        s.ns = sel3(usable, normalize3(ns), s.ns);
    }
#endif
#if USES_UVS
    mask mapped = triangle & ((shape.flags & SHAPE_UVS) != 0);
    if (any(mapped)) {
        vec2 ta = vertex_vec2(scene.uvs, a), tb = vertex_vec2(scene.uvs, b), tc = vertex_vec2(scene.uvs, c);
        s.uv.x = sel(mapped, ta.x * w + tb.x * u + tc.x * v, s.uv.x);
        s.uv.y = sel(mapped, ta.y * w + tb.y * u + tc.y * v, s.uv.y);
#if USES_TANGENTS
        vec3 pa = VERTEX_VEC3(scene.vertices, a);
        vec3 e1 = sub3(VERTEX_VEC3(scene.vertices, b), pa), e2 = sub3(VERTEX_VEC3(scene.vertices, c), pa);
        real du1 = tb.x - ta.x, dv1 = tb.y - ta.y, du2 = tc.x - ta.x, dv2 = tc.y - ta.y;
        real det = du1 * dv2 - dv1 * du2;
        mask regular = mapped & (fabs(det) > 1e-20f);
        real inv = 1.0f / sel(regular, det, (real)(1.0f));
        s.dpdu = sel3(regular, scale3(sub3(scale3(e1, dv2), scale3(e2, dv1)), inv), s.dpdu);
        s.dpdv = sel3(regular, scale3(sub3(scale3(e2, du1), scale3(e1, du2)), inv), s.dpdv);
#if USES_INSTANCES
        s.dpdu = sel3(placed, instance_vector(space, s.dpdu), s.dpdu);
        s.dpdv = sel3(placed, instance_vector(space, s.dpdv), s.dpdv);
#endif
#endif
    }
#if VERTEX_TANGENTS
    mask told = smooth & ((shape.flags & SHAPE_TANGENTS) != 0);
    if (any(told)) {
        integer first = (integer)(VERTEX_TANGENTS);
        vec4 qa = gather4(scene.distributions, first + 4 * a), qb = gather4(scene.distributions, first + 4 * b);
        vec4 qc = gather4(scene.distributions, first + 4 * c);
        vec3 along = madd3(v3(qa.x, qa.y, qa.z), w, madd3(v3(qb.x, qb.y, qb.z), u,
                           scale3(v3(qc.x, qc.y, qc.z), v)));
        vec3 beside = scale3(cross3(own_normal, along), sel(qa.w < 0.0f, (real)(-1.0f), (real)(1.0f)));
#if USES_INSTANCES
        along = sel3(placed, instance_vector(space, along), along);
        beside = sel3(placed, instance_vector(space, beside), beside);
#endif
        told = told & (dot3(beside, beside) > 1e-12f);
        s.dpdu = sel3(told, tangent_of_length(along, s.dpdu), s.dpdu);
        s.dpdv = sel3(told, tangent_of_length(beside, s.dpdv), s.dpdv);
    }
#endif
#endif
#if USES_ANALYTIC
    mask analytic = active & (shape.kind != 0);
    if (any(analytic)) {
#if MOVES_SHAPES
        Motion motion = motion_of_shape(scene, shape.number);
        vec3 rest = onto_of_shape(scene, shape, prim, motion_point_back(motion, madd3(d, h.t, o)));
        s.p = sel3(analytic, motion_point(motion, rest), s.p);
#else
        s.p = sel3(analytic, onto_of_shape(scene, shape, prim, madd3(d, h.t, o)), s.p);
#endif
#if SCREEN_MOTION && MOVES_SPHERES
        mask spheres = analytic & ((shape.flags & SHAPE_MANY) != 0);
        global const float *opens = scene.distributions + as_int(scene.distributions[MOTION_ROW]);
#if MOVES_SHAPES
        vec3 on = rest;
#else
        vec3 on = s.p;
#endif
        vec3 first_way = spheres_way(scene, shape, prim, spheres, on, (real)(opens[1]));
        vec3 last_way = spheres_way(scene, shape, prim, spheres, on, (real)(opens[1] + opens[2]));
#if MOVES_SHAPES
        first_way = motion_vector(motion, first_way);
        last_way = motion_vector(motion, last_way);
#endif
        s.to_open = sel3(spheres, first_way, s.to_open);
        s.to_close = sel3(spheres, last_way, s.to_close);
#endif
        s.size = sel(analytic, size_of_shape(scene, shape, prim), s.size);
#if USES_TANGENTS
#if MOVES_SHAPES
        vec3 dpdu = dpdu_of_shape(scene, shape, prim, rest, s.uv), dpdv = dpdv_of_shape(scene, shape, prim, rest, s.uv);
        s.dpdu = sel3(analytic, motion_vector(motion, dpdu), s.dpdu);
        s.dpdv = sel3(analytic, motion_vector(motion, dpdv), s.dpdv);
#else
        s.dpdu = sel3(analytic, dpdu_of_shape(scene, shape, prim, s.p, s.uv), s.dpdu);
        s.dpdv = sel3(analytic, dpdv_of_shape(scene, shape, prim, s.p, s.uv), s.dpdv);
#endif
#endif
    }
#endif
    *front = dot3(s.n, d) < 0.0f;
    /* Each normal is turned to the viewer by itself: where they disagree, as at the silhouette of a coarse
     * mesh, a BSDF that saw its back would be black. */
#undef VERTEX_VEC3
    mask both = (shape.flags & SHAPE_TWO_SIDED) != 0;
    s.flipped = both & (dot3(s.ns, d) > 0.0f);
    s.n = sel3(both & !*front, neg3(s.n), s.n);
    s.ns = sel3(s.flipped, neg3(s.ns), s.ns);
    return s;
}

/* A point of a medium, as a surface without extent: it has no normal. */
inline Surface surface_of_point(vec3 p)
{
    Surface s;
    s.p = p;
    s.size = 0.0f;
    s.n = v3(0.0f, 0.0f, 0.0f);
    s.ns = s.n;
    s.dpdu = s.n;
    s.dpdv = s.n;
    s.uv.x = 0.0f;
    s.uv.y = 0.0f;
    s.flipped = mask_of(0);
    s.light = -1;
    s.footprint = 0.0f;
#if USES_ATTRIBUTES
    s.attributes = 0;
    s.face = 0;
    s.b = s.uv;
#endif
#if SCREEN_MOTION && (MOVES_VERTICES || MOVES_SPHERES)
    s.to_open = s.n;
    s.to_close = s.n;
#endif
    return s;
}

/* The same from what the intersect stage has kept. */
inline Surface surface_load(Scene scene, Slab hit, uint at, mask active, vec3 o, vec3 d, mask *front)
{
    TraceHit h = {load_hit_t(hit, at), load_hit_u(hit, at), load_hit_v(hit, at), load_hit_n(hit, at),
                  load_hit_plane(hit, at), load_hit_side(hit, at), load_hit_prim(hit, at), load_hit_shape(hit, at)};
#if USES_INSTANCES
    h.instance = load_hit_instance(hit, at);
#endif
    return surface_at(scene, h, active, o, d, front);
}

inline TexturePoint surface_texture_point(Surface s)
{
    TexturePoint t = texture_point(s.uv, s.p);
#if USES_ATTRIBUTES
    t.attributes = s.attributes;
    t.face = s.face;
    t.b = s.b;
#endif
    t.footprint = s.footprint;
    return t;
}

/* The shading frame: s along dpdu where there is one (Mitsuba's and pbrt's convention). */
inline Frame surface_frame(Surface s)
{
    Frame f = frame_of(s.ns);
#if USES_TANGENTS
    vec3 t = sub3(s.dpdu, scale3(s.ns, dot3(s.ns, s.dpdu)));
    mask given = dot3(t, t) > 1e-20f;
    t = normalize3(sel3(given, t, f.s));
    f.s = t;
    f.t = cross3(s.ns, t);
#endif
    return f;
}

/* Where a ray toward `w` starts: off the surface by more than what rounding may have put it under. */
inline vec3 surface_offset(Surface s, vec3 w)
{
    real step = rounding_step(s.p, s.size);
    return madd3(s.n, sel(dot3(s.n, w) < 0.0f, -step, step), s.p);
}

/* How far along the unit vector `w` that is, where it does not graze the surface. */
inline real surface_lead(Surface s, vec3 w)
{
    return rounding_step(s.p, s.size) / max_r(fabs(dot3(s.n, w)), (real)(0.01f));
}
