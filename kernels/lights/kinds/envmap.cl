/* An image in latitude and longitude, as Mitsuba's envmap: +y is up, the image's middle lies at +z, its left and right
 * edges at -z, and +x a quarter from the left. Rows run from pole to pole, the first and the last row on the poles;
 * columns wrap. Radiance is bilinear between texels in both modes, while Mitsuba's spectral variants interpolate a
 * spectrum's shape and its factor separately. */
#include "core/grid.cl"

inline Grid envmap_grid(Envmap l)
{
    return (Grid){l.height - 1, l.width, (integer)(1), l.corners, l.marginal, l.conditional, l.blocks, l.block_rows,
                  l.block_columns, l.norm};
}

inline integer envmap_receiver(Envmap l, vec3 n)
{
    return grid_receiver(envmap_grid(l), hemisphere_given(n), v3(dot3(n, l.x), dot3(n, l.y), dot3(n, l.z)));
}

/* Cells lie between the texels' centres. */
typedef struct {
    integer row, column;
    vec2 at;
    real sin_t; /* of the angle from the pole */
} EnvmapPoint;

inline EnvmapPoint envmap_point(Envmap l, vec3 d)
{
    real x = dot3(d, l.x), y = dot3(d, l.y), z = dot3(d, l.z);
    EnvmapPoint p;
    p.sin_t = sqrt(x * x + z * z);
    real u = atan2_r(x, -z) * INV_2PI, v = atan2_r(p.sin_t, y) * INV_PI;
    real column = (u + sel(u < 0.0f, (real)(1.0f), (real)(0.0f))) * to_real(l.width) - 0.5f;
    real row = v * to_real(l.height - 1);
    p.row = clamp_i(to_integer(row), l.height - 2); /* even where d is not finite */
    p.at.y = row - to_real(p.row);
    real left = floor(column);
    p.at.x = column - left;
    p.column = to_integer(left);
    p.column = clamp_i(p.column + sel_i(p.column < 0, l.width, (integer)(0)), l.width - 1);
    return p;
}

inline real envmap_solid_angle_pdf(Envmap l, real pdf, real sin_t)
{
    real cells = to_real(l.width) * to_real(l.height - 1);
    return pdf * cells * (INV_2PI * INV_PI) / max_r(sin_t, (real)(1e-7f));
}

inline Spectrum envmap_between(Envmap l, Scene scene, integer row, integer column, vec2 at, Wavelengths lambdas)
{
    integer right = sel_i(column + 1 == l.width, (integer)(0), column + 1), left = row * l.width;
    integer below = left + l.width;
    return texels_between(scene, l.texels, left + column, left + right, below + column, below + right, at, lambdas);
}

Spectrum envmap_radiance(Envmap l, Scene scene, vec3 d, Wavelengths lambdas)
{
    EnvmapPoint p = envmap_point(l, d);
    return envmap_between(l, scene, p.row, p.column, p.at, lambdas);
}

real envmap_pdf(Envmap l, Scene scene, vec3 hemisphere, vec3 d)
{
    EnvmapPoint p = envmap_point(l, d);
    integer receiver = envmap_receiver(l, hemisphere);
    return envmap_solid_angle_pdf(l, grid_pdf(scene, envmap_grid(l), receiver, p.row, p.column, p.at), p.sin_t);
}

/* A direction with its density, dark so far. */
inline LightSample envmap_direction(Envmap l, GridPoint g)
{
    real turn = (to_real(g.column) + 0.5f + g.at.x) / to_real(l.width);
    real half_turn = 0.5f * (to_real(g.row) + g.at.y) / to_real(l.height - 1), sin_p, cos_p, sin_t, cos_t;
    sincos_2pi(turn - floor(turn), &sin_p, &cos_p);
    sincos_2pi(half_turn, &sin_t, &cos_t);
    LightSample s;
    s.wi = madd3(l.x, sin_p * sin_t, madd3(l.y, cos_t, scale3(l.z, -cos_p * sin_t)));
    s.t = FAR;
    s.radiance = spectrum_of(0.0f);
    s.pdf = envmap_solid_angle_pdf(l, g.pdf, sin_t);
    return s;
}

LightSample envmap_sample(Envmap l, Scene scene, vec3 hemisphere, vec2 u, Wavelengths lambdas)
{
    GridPoint g = grid_sample(scene, envmap_grid(l), envmap_receiver(l, hemisphere), u);
    LightSample s = envmap_direction(l, g);
    s.radiance = envmap_between(l, scene, g.row, g.column, g.at, lambdas);
    return s;
}
