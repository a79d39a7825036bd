/* By which wavelengths light came that leaves a fluorescent surface (Mojzik et al. 2018, for paths
 * from the camera). A matrix lies in `distributions`, on a grid of SHIFT_STEP nm from lambda_min: the
 * integral of each row, then of each row its values [1/nm] and its normalised running integral. */
#include "lib/grid.cl"
#define SHIFT_CELLS ((SPECTRA_SIZE - 1 + SHIFT_STEP - 1) / SHIFT_STEP)
#define SHIFT_ROW (2 * SHIFT_CELLS + 1)

/* A wavelength in, with the density of the matrix, bilinear between its nodes, at one out: one of the
 * two rows around it, then a cell of that row, then a place in the cell. */
inline real reradiation_sample(Scene scene, integer table, real out, real u)
{
    float low = scene.settings->lambda_min;
    real x = clamp_r((out - low) * (1.0f / SHIFT_STEP), (real)(0.0f), (real)(SHIFT_CELLS - 0.001f));
    integer row = to_integer(x);
    real t = x - to_real(row);
    real a = gather(scene.distributions, table + row) * (1.0f - t), b = gather(scene.distributions, table + row + 1) * t;
    real share = a / max_r(a + b, (real)(1e-30f));
    u = clamp_r(u, (real)(0.0f), (real)(0.99999994f));
    mask first = u < share;
    real rest = sel(first, u, u - share) / max_r(sel(first, share, 1.0f - share), (real)(1e-20f));
    rest = clamp_r(rest, (real)(0.0f), (real)(0.99999994f));
    row = sel_i(first, row, row + 1);
    integer values = table + (SHIFT_CELLS + 1) + row * SHIFT_ROW, running = values + (SHIFT_CELLS + 1);
    integer cell = grid_search(scene, running, (integer)(SHIFT_CELLS), rest);
    real place = linear_sample(grid_rest(scene, running, cell, rest), gather(scene.distributions, values + cell),
                               gather(scene.distributions, values + cell + 1));
    return low + (to_real(cell) + place) * SHIFT_STEP;
}

/* The wavelengths in, of a path's wavelengths out: each stays with the probability that its light was
 * reflected, else it is drawn from the matrix; *elastic and *glow become the weight of what happens, and
 * zero. All four use one number, each a quarter further, so that they stay exchangeable: which one is the
 * hero makes no difference. In proportion to the shares that probability gives every event the weight
 * r + g. That is above one where much is given out, and squares of weights could grow for ever between
 * bright walls; with r^(3/2) at least, they shrink by r^(1/2) a bounce (up to r = 0.93: a tenth is left for
 * what is given out). */
inline Wavelengths reradiation_shift(Scene scene, integer table, Spectrum *elastic, Spectrum *glow, real amount,
                                     Wavelengths lambdas, real u)
{
    real offset = 0.0f;
    Wavelengths into;
#define C(c)                                                                                      \
    {                                                                                             \
        real r = elastic->c, g = glow->c * amount, v = u + offset;                                \
        real stay = max_r(r / max_r(r + g, (real)(1e-20f)), min_r(r * sqrt_r(r), (real)(0.9f)));  \
        v -= floor(v);                                                                            \
        mask shifts = (v >= stay) & (g > 0.0f);                                                   \
        stay = sel(g > 0.0f, stay, (real)(1.0f));                                                 \
        real go = max_r(1.0f - stay, (real)(1e-7f));                                              \
        into.c = lambdas.c;                                                                       \
        if (any(shifts)) into.c = sel(shifts, reradiation_sample(scene, table, lambdas.c, (v - stay) / go), into.c); \
        elastic->c = sel(shifts, g / go, r / max_r(stay, (real)(1e-20f)));                        \
        glow->c = 0.0f;                                                                           \
        offset += 0.25f;                                                                          \
    }
    SPECTRUM_EACH(C)
#undef C
    return into;
}
