/* The point of a surface that a ray hit, with all that shading asks for. */

/* Step. */
#include "core/rounding.cl"
#include "shapes/surface.cl#flags"
#include "tracing/trace.cl"
#include "shapes/surface_point.cl"
#include "generated/hit_space.cl"
#include "generated/surface_steps.cl"

/* The surface where the ray from `o` along `d` ends. `front` tells which side was hit. A two-sided back has its normals
 * negated, so that the BSDF sees a front. */
inline Surface surface_at(Scene scene, TraceHit h, mask active, vec3 o, vec3 d, mask *front)
{
    integer row = sel_i(active, h.shape, (integer)(0)) * SHAPE_ROW_WORDS;
    ShapeRow shape = shape_row_row(scene.shapes, row);
    integer prim = sel_i(active, h.prim, (integer)(0));
    HitSpace space = hit_space(scene, h, active);
    Surface s = surface_met(h, active, o, d);
    s.light = surface_light(shape, prim, active);
    surface_attributes(scene, shape, prim, active, &s);
    surface_deforms(scene, shape, space, prim, active, h, &s);
    surface_triangle(scene, shape, space, prim, active, &s);
    surface_analytic(scene, shape, prim, active, madd3(d, h.t, o), &s);
    *front = dot3(s.n, d) < 0.0f;
    return surface_turned(s, shape, *front, d);
}

/* The surface of a hit that the intersect stage has stored. */
inline Surface surface_load(Scene scene, Slab hit, uint at, mask active, vec3 o, vec3 d, mask *front)
{
    TraceHit h = {load_hit_t(hit, at), load_hit_u(hit, at), load_hit_v(hit, at), load_hit_n(hit, at),
                  load_hit_plane(hit, at), load_hit_side(hit, at), load_hit_prim(hit, at), load_hit_shape(hit, at)};
    hit_space_load(&h, hit, at);
    return surface_at(scene, h, active, o, d, front);
}

inline TexturePoint surface_texture_point(Surface s)
{
    TexturePoint t = texture_point(s.uv, s.p);
    surface_attributes_tell(s, &t);
    t.footprint = s.footprint;
    return t;
}

/* The shading frame: s along u where the surface has uv (Mitsuba's and pbrt's convention). */
inline Frame surface_frame(Surface s)
{
    Frame f = frame_of(s.ns);
#if USES_TANGENTS
    vec3 t = sub3(s.along, scale3(s.ns, dot3(s.ns, s.along)));
    mask given = dot3(t, t) > 1e-20f;
    t = normalize3(sel3(given, t, f.s));
    f.s = t;
    f.t = cross3(s.ns, t);
#endif
    return f;
}

/* The origin of a ray along `w`: off the surface by more than the rounding of p. */
inline vec3 surface_offset(Surface s, vec3 w)
{
    real step = rounding_step(s.p, s.size);
    return madd3(s.n, sel(dot3(s.n, w) < 0.0f, -step, step), s.p);
}

/* The distance of that origin along the unit vector `w`, where w does not graze the surface. */
inline real surface_ray_offset(Surface s, vec3 w)
{
    return rounding_step(s.p, s.size) / max_r(fabs(dot3(s.n, w)), (real)(0.01f));
}

/* Step flags: material words; bits of ShapeRow.flags. */
#include "generated/shape_bits.cl"
#include "generated/material_kinds.cl"

/* A material word names a leaf: its kind in the upper 8 bits, the first word of its row below. */
#define MATERIAL_KIND(w) (((w) >> 24) & 0xff)
#define MATERIAL_ROW(w) ((w) & 0xffffff)

/* Step attributes: where textures find the attributes of a mesh, per vertex or face, at a point. */
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

/* Moves a point by u and v along the surface. */
inline void surface_attributes_move(Surface s, real u, real v, TexturePoint *t)
{
    t->b.x += s.dbdu.x * u + s.dbdv.x * v;
    t->b.y += s.dbdu.y * u + s.dbdv.y * v;
}

/* Twin, where no texture reads attributes. */
inline void surface_attributes(Scene scene, ShapeRow shape, integer prim, mask active, Surface *s) {}
inline void surface_attributes_tell(Surface s, TexturePoint *t) {}
inline void surface_attributes_move(Surface s, real u, real v, TexturePoint *t) {}

/* Step deforms: positions of a point of a deforming mesh when the shutter opens and closes, for the motion layer. */
inline void surface_deforms(Scene scene, ShapeRow shape, HitSpace space, integer prim, mask active, TraceHit h,
                            Surface *s)
{
    mask deforms = active & ((shape.flags & SHAPE_DEFORMS) != 0);
    if (any(deforms)) {
        integer number = sel_i(deforms, shape.number, (integer)(0)), face = sel_i(deforms, prim, (integer)(0));
        global const float *shutter = scene.distributions + as_int(scene.distributions[MOTION_ROW]);
        vec3 now = vertex_point(scene, number, face, h.u, h.v, scene.time);
        vec3 first = sub3(vertex_point(scene, number, face, h.u, h.v, (real)(shutter[1])), now);
        vec3 last = sub3(vertex_point(scene, number, face, h.u, h.v, (real)(shutter[1] + shutter[2])), now);
        s->to_open = sel3(deforms, hit_vector(space, first), s->to_open);
        s->to_close = sel3(deforms, hit_vector(space, last), s->to_close);
    }
}

/* Twin, where no mesh deforms, or the film has no motion layer. */
inline void surface_deforms(Scene scene, ShapeRow shape, HitSpace space, integer prim, mask active, TraceHit h,
                            Surface *s) {}
