/* Where a point of a triangle is on the unit square of textures, and how it moves with that. */
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
