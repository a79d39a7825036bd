/* Emission of a medium on a grid: absorption times a radiance (Kirchhoff). The radiance is the medium's, times numbers
 * on the grid, or that of a black body with its temperature on the grid. These grids have the density's points, and are
 * trilinear between them; all eight points around count, because Planck's law is not linear.
 *
 * In `materials` six words follow the row of a grid. The first is where in `images` a table begins with a word for
 * each brick, 0 without light; that word is 1 + the brick's row of `lights`, 0 for a dark brick, -1 for a brick that
 * emits and is no light. The second is 1 for black bodies, 2 for normalised black bodies, else 0. The third is where
 * in `images` the numbers' bricks begin, 0 without numbers. The fourth is the factor of black bodies. The last two
 * serve black bodies in RGB mode: the first float of their colours in `distributions`, and the number of colours to
 * a kelvin. */
#define GRID_LIGHT (2 * MEDIUM_SCATTERING + 19) /* words from a medium's row */

inline integer grid_brick_number(GridWalk w) { return (w.z * w.ny + w.y) * w.nx + w.x; }

/* The word of the walk's brick in that table. */
inline integer grid_light_row(Scene scene, integer name, GridWalk w, mask active)
{
    integer table = gather_i(scene.materials, sel_i(active, MEDIUM_ROW(name) + GRID_LIGHT, (integer)(0)));
    active = active & (table != 0);
    integer row = gather_i(scene.images, sel_i(active, table + grid_brick_number(w), (integer)(0)));
    return sel_i(active, row, (integer)(0));
}

/* The trilinear number at the walk's point, in bricks that begin at word `first` of `images`. */
inline real grid_number(Scene scene, GridWalk w, integer first, mask active)
{
    integer at = sel_i(active, first + 2 * grid_brick_number(w), (integer)(0));
    integer points = first + gather_i(scene.images, at);
    real most = gather_w(scene.images, at + 1), sum = 0.0f;
    active = active & (most > 0.0f);
#define AXIS(a)                                                                                                \
    real p_##a = clamp_r(w.o.a + w.t * w.d.a - to_real(BRICK_CELLS * w.a), (real)(0.0f), (real)(BRICK_CELLS)); \
    integer c_##a = clamp_i(to_integer(p_##a), (integer)(BRICK_CELLS - 1));                                    \
    p_##a -= to_real(c_##a);
    AXIS(x)
    AXIS(y)
    AXIS(z)
#undef AXIS
    integer corner = (c_z * BRICK_POINTS + c_y) * BRICK_POINTS + c_x;
    for (int i = 0; i < 8; i++) {
        integer point = corner + ((i >> 2) * BRICK_POINTS + ((i >> 1) & 1)) * BRICK_POINTS + (i & 1);
        integer word = gather_i(scene.images, sel_i(active, points + (point >> 1), (integer)(0)));
        real share = (i & 1 ? p_x : 1.0f - p_x) * (i & 2 ? p_y : 1.0f - p_y) * (i & 4 ? p_z : 1.0f - p_z);
        sum += share * to_real((word >> ((point & 1) << 4)) & 0xffff);
    }
    return sel(active, sum * most * (1.0f / 65535.0f), (real)(0.0f));
}

#include "generated/grid_glow.cl"

/* Emission at the walk's point [W m^-3 sr^-1 nm^-1], estimated by the density of a random point around. */
inline Spectrum grid_emission(Scene scene, integer name, Medium m, GridWalk w, GridBrick b, mask active, natural bits,
                              Wavelengths lambdas)
{
    integer row = sel_i(active, MEDIUM_ROW(name), (integer)(MEDIUM_LIGHT)), at = sel_i(active, row + GRID_LIGHT, row);
    real density = b.most * brick_density(scene, w, b, active & (b.most > 0.0f), bits);
    integer source = sel_i(active, gather_i(scene.materials, at + 2), (integer)(0));
    real number = sel(source != 0, grid_number(scene, w, source, active & (source != 0)), (real)(1.0f));
    Spectrum light = spectrum_scale(medium_light(scene, row - MEDIUM_LIGHT, texture_point_nowhere(), lambdas), number);
    light = grid_glow(scene, at, number, active, lambdas, light);
    m = grid_medium(scene, name, m, w, active, bits, lambdas);
    Spectrum absorbs = spectrum_sub(m.sigma_t, m.sigma_s);
#define C(c) light.c *= max_r(absorbs.c, (real)(0.0f)) * density;
    SPECTRUM_EACH(C)
#undef C
    return light;
}

/* A walk that stays at the point p of a brick. */
inline GridWalk grid_point(Scene scene, integer name, integer number, vec3 p, mask active)
{
    integer at = sel_i(active, MEDIUM_ROW(name) + 2 * MEDIUM_SCATTERING, (integer)(0));
    GridWalk w;
    grid_enter(scene, name, at, p, v3(0.0f, 0.0f, 0.0f), &w);
    w.x = number % w.nx;
    w.y = (number / w.nx) % w.ny;
    w.z = number / (w.nx * w.ny);
    w.t = 0.0f;
    w.end = 0.0f;
    return w;
}

/* Step glow: the light of a grid at a point with this temperature, that of a black body; `light` for grids without
 * temperatures. at: the grid's words. */
inline Spectrum grid_glow(Scene scene, integer at, real number, mask active, Wavelengths lambdas, Spectrum light)
{
    integer kind = gather_i(scene.materials, at + 1);
    mask glows = active & (kind != 0);
    if (any(glows)) {
        light = spectrum_sel(glows, grid_black_body(scene, at, number, kind == 2, glows, lambdas), light);
    }
    return light;
}

/* Twin, where no grid has a temperature. */
inline Spectrum grid_glow(Scene scene, integer at, real number, mask active, Wavelengths lambdas, Spectrum light)
{
    return light;
}

/* Step black_body: Planck's law [W m^-2 sr^-1 nm^-1] times a factor, at the wavelengths of a path. normalised: the
 * largest value is 1. at: the grid's words. */
inline Spectrum grid_black_body(Scene scene, integer at, real kelvin, mask normalised, mask active, Wavelengths lambdas)
{
    real factor = gather_w(scene.materials, at + 3);
    mask hot = active & (kelvin > 1.0f);
    kelvin = sel(hot, kelvin, (real)(1.0f));
    real t2 = kelvin * kelvin, top = 4.0956747e-15f * t2 * t2 * kelvin;
    factor *= sel(normalised, 1.0f / top, (real)(1.0f));
    Spectrum r;
#define C(c)                                                                                        \
    real nm_##c = lambdas.c, m2_##c = nm_##c * nm_##c;                                              \
    real less_##c = exp_r(-min_r(1.438776877e7f / (nm_##c * kelvin), (real)(80.0f)));               \
    r.c = sel(hot, factor * 1.191042972e20f / (m2_##c * m2_##c * nm_##c) * less_##c / (1.0f - less_##c), (real)(0.0f));
    SPECTRUM_EACH(C)
#undef C
    return r;
}

/* Twin, in RGB mode: from a table of colours. */
inline Spectrum grid_black_body(Scene scene, integer at, real kelvin, mask normalised, mask active, Wavelengths lambdas)
{
    real factor = gather_w(scene.materials, at + 3);
    mask hot = active & (kelvin > 1.0f);
    kelvin = sel(hot, kelvin, (real)(1.0f));
    real place = kelvin * gather_w(scene.materials, at + 5);
    integer cell = clamp_i(to_integer(place), (integer)(1022));
    real share = clamp_r(place - to_real(cell), (real)(0.0f), (real)(1.0f));
    integer first = sel_i(hot, gather_i(scene.materials, at + 4) + 3 * cell, (integer)(0));
    Spectrum r;
#define C(c, i)                                                             \
    real low_##c = gather(scene.distributions, first + i);                  \
    r.c = sel(hot, low_##c + share * (gather(scene.distributions, first + 3 + i) - low_##c), (real)(0.0f));
    C(x, 0)
    C(y, 1)
    C(z, 2)
#undef C
    return r;
}
