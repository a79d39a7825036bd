/* Six square images around the scene, placed as OpenGL places a cube map's faces (OpenGL 4.6 core, table 8.19), with a
 * border of a single texel of their neighbours. Bilinear between texels; the cells of the grid are half a texel
 * wide. */
#include "core/grid.cl"

typedef struct {
    integer face;
    real a, b;     /* on the face, to the right and down, [-1, 1] */
    real jacobian; /* d(a b) over d(solid angle) */
} CubePoint;

inline CubePoint cube_map_point(CubeMap l, vec3 d)
{
    real x = dot3(d, l.x), y = dot3(d, l.y), z = dot3(d, l.z), ax = fabs(x), ay = fabs(y), az = fabs(z);
    mask on_x = (ax >= ay) & (ax >= az), on_y = !on_x & (ay >= az);
    real size = sel(on_x, ax, sel(on_y, ay, az)), major = sel(on_x, x, sel(on_y, y, z));
    mask back = major < 0.0f;
    real sign = sel(back, (real)(-1.0f), (real)(1.0f)), over = 1.0f / size;
    CubePoint p;
    p.face = sel_i(on_x, (integer)(0), sel_i(on_y, (integer)(2), (integer)(4))) +
             sel_i(back, (integer)(1), (integer)(0));
    p.a = sel(on_x, -z * sign, sel(on_y, x, x * sign)) * over;
    p.b = sel(on_y, z * sign, -y) * over;
    real r2 = 1.0f + p.a * p.a + p.b * p.b;
    p.jacobian = r2 * sqrt(r2);
    return p;
}

inline Grid cube_map_grid(CubeMap l)
{
    return (Grid){l.width * 12, l.width * 2, (integer)(6), l.corners, l.marginal, l.conditional, l.blocks, l.block_rows,
                  l.block_columns, l.norm};
}

inline integer cube_map_receiver(CubeMap l, vec3 n)
{
    return grid_receiver(cube_map_grid(l), hemisphere_given(n), v3(dot3(n, l.x), dot3(n, l.y), dot3(n, l.z)));
}

inline Spectrum cube_map_between(CubeMap l, Scene scene, CubePoint p, Wavelengths lambdas)
{
    real column = (p.a + 1.0f) * 0.5f * to_real(l.width) + 0.5f, row = (p.b + 1.0f) * 0.5f * to_real(l.width) + 0.5f;
    integer i = clamp_i(to_integer(column), l.width), j = clamp_i(to_integer(row), l.width), stride = l.width + 2;
    vec2 at = {column - to_real(i), row - to_real(j)};
    integer k = (p.face * stride + j) * stride + i;
    return texels_between(scene, l.texels, k, k + 1, k + stride, k + stride + 1, at, lambdas);
}

Spectrum cube_map_radiance(CubeMap l, Scene scene, vec3 d, Wavelengths lambdas)
{
    return cube_map_between(l, scene, cube_map_point(l, d), lambdas);
}

real cube_map_pdf(CubeMap l, Scene scene, vec3 hemisphere, vec3 d)
{
    CubePoint p = cube_map_point(l, d);
    real cells = to_real(l.width * 2), column = (p.a + 1.0f) * 0.5f * cells, row = (p.b + 1.0f) * 0.5f * cells;
    integer last = l.width * 2 - 1, i = clamp_i(to_integer(column), last), j = clamp_i(to_integer(row), last);
    vec2 at = {column - to_real(i), row - to_real(j)};
    integer receiver = cube_map_receiver(l, hemisphere);
    real pdf = grid_pdf(scene, cube_map_grid(l), receiver, p.face * l.width * 2 + j, i, at);
    return pdf * sqr(to_real(l.width)) * p.jacobian;
}

LightSample cube_map_sample(CubeMap l, Scene scene, vec3 hemisphere, vec2 u, Wavelengths lambdas)
{
    GridPoint g = grid_sample(scene, cube_map_grid(l), cube_map_receiver(l, hemisphere), u);
    real step = 1.0f / to_real(l.width);
    CubePoint c;
    c.face = to_integer((to_real(g.row) + 0.5f) * 0.5f * step);
    c.a = (to_real(g.column) + g.at.x) * step - 1.0f;
    c.b = (to_real(g.row - c.face * l.width * 2) + g.at.y) * step - 1.0f;
    real r2 = 1.0f + c.a * c.a + c.b * c.b, sign = sel((c.face & 1) == 1, (real)(-1.0f), (real)(1.0f));
    c.jacobian = r2 * sqrt(r2);
    mask on_x = c.face < 2, on_y = !on_x & (c.face < 4);
    vec3 d = sel3(on_x, v3(sign, -c.b, -c.a * sign), sel3(on_y, v3(c.a, sign, c.b * sign), v3(c.a * sign, -c.b, sign)));
    LightSample s;
    s.wi = normalize3(madd3(l.x, d.x, madd3(l.y, d.y, scale3(l.z, d.z))));
    s.t = FAR;
    s.radiance = cube_map_between(l, scene, c, lambdas);
    s.pdf = g.pdf * sqr(to_real(l.width)) * c.jacobian;
    return s;
}
