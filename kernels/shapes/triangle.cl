/* What a mesh tells of a point of a triangle: shading normal, uv, and the directions along these. */
#include "shapes/corners.cl"
#include "generated/triangle_steps.cl"

inline void surface_triangle(Scene scene, ShapeRow shape, HitSpace space, integer prim, mask active, Surface *s)
{
    Corners c = corners_of(scene, shape, prim, active, s->uv);
    triangle_normal(scene, space, &c, s);
    triangle_uv(scene, shape, space, c, s);
    triangle_second_uv(scene, shape, space, c, s);
    triangle_tangents(scene, shape, space, c, s);
}

/* Twin, where nothing asks for more than the flat triangle. */
inline void surface_triangle(Scene scene, ShapeRow shape, HitSpace space, integer prim, mask active, Surface *s) {}
