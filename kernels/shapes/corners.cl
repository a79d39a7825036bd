/* The corners of a triangle, for what a mesh tells of them. */
#include "generated/corner_rows.cl"

/* The corners of a triangle, and where between them a point lies. */
typedef struct {
    mask triangle;
    integer a, b, c; /* the vertices */
    real u, v, w;    /* barycentrics of b, c and a */
    CornerKeys keys; /* see shapes/corner_rows.cl */
    mask smooth;     /* the mesh has normals */
    vec3 normal;     /* as these tell it, before what an instance does; of any length */
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
