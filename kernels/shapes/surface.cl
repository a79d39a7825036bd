/* The point of a surface that a ray hit, with all that shading asks for. */
#include "core/rounding.cl"
#include "shapes/surface_flags.cl"
#include "tracing/trace.cl"
#include "shapes/surface_point.cl"
#include "shapes/map_frame.cl"
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

/* That from what the intersect stage has kept. */
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

/* The shading frame: s along u where there is one (Mitsuba's and pbrt's convention). */
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

/* Where a ray toward `w` starts: off the surface by more than what rounding may have put it under. */
inline vec3 surface_offset(Surface s, vec3 w)
{
    real step = rounding_step(s.p, s.size);
    return madd3(s.n, sel(dot3(s.n, w) < 0.0f, -step, step), s.p);
}

/* How far along the unit vector `w` that is, where it does not graze the surface. */
inline real surface_ray_offset(Surface s, vec3 w)
{
    return rounding_step(s.p, s.size) / max_r(fabs(dot3(s.n, w)), (real)(0.01f));
}
