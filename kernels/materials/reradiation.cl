/* Samples the incident wavelengths of light from a fluorescent surface (Mojzik et al. 2018, for camera paths). A
 * matrix lies in `distributions`, on a grid of RERADIATION_STEP nm from lambda_min
 * (clpt/render/spectra/encode.py): at each node the expected light, then the integral of each
 * row times that, then of each row its values [1/nm] and the normalised running integral of the product. */
#include "core/grid.cl"
#include "generated/reradiation_sizes.cl"
#define SHIFT_CELLS ((int)((SPECTRA_SIZE - 1) * SPECTRA_STEP + (RERADIATION_STEP - 1e-3f)) / RERADIATION_STEP)
#define SHIFT_ROW (2 * SHIFT_CELLS + 1)

/* A cell of the grid, and how far along it: [0, 1). */
inline integer shift_cell(Scene scene, real lambda, real *along)
{
    real x = clamp_r((lambda - scene.settings->lambda_min) * (1.0f / RERADIATION_STEP), (real)(0.0f),
                     (real)(SHIFT_CELLS - 0.001f));
    integer cell = to_integer(x);
    *along = x - to_real(cell);
    return cell;
}
inline real shift_between(Scene scene, integer first, real along)
{
    real a = gather(scene.distributions, first);
    return a + along * (gather(scene.distributions, first + 1) - a);
}

/* A wavelength in, with density proportional to the matrix at `out` times the light to expect, both
 * linear between nodes: either row around `out`, a cell of it, a point of the cell. *weight: the matrix
 * over that density. */
inline real reradiation_sample(Scene scene, integer table, real out, real u, real *weight)
{
    real t;
    integer row = shift_cell(scene, out, &t), sums = table + (SHIFT_CELLS + 1), rows = sums + (SHIFT_CELLS + 1);
    real a = gather(scene.distributions, sums + row) * (1.0f - t), b = gather(scene.distributions, sums + row + 1) * t;
    real whole = a + b, share = a / max_r(whole, (real)(1e-30f));
    u = clamp_r(u, (real)(0.0f), (real)(0.99999994f));
    mask first = u < share;
    real left = sel(first, u, u - share) / max_r(sel(first, share, 1.0f - share), (real)(1e-20f));
    left = clamp_r(left, (real)(0.0f), (real)(0.99999994f));
    integer near = rows + row * SHIFT_ROW, far = near + SHIFT_ROW, values = sel_i(first, near, far);
    integer running = values + (SHIFT_CELLS + 1), cell = grid_search(scene, running, (integer)(SHIFT_CELLS), left);
    real i0 = gather(scene.distributions, table + cell), i1 = gather(scene.distributions, table + cell + 1);
    real along = linear_sample(grid_rest(scene, running, cell, left), i0 * gather(scene.distributions, values + cell),
                               i1 * gather(scene.distributions, values + cell + 1));
    real p0 = gather(scene.distributions, near + cell), p1 = gather(scene.distributions, near + cell + 1);
    p0 += t * (gather(scene.distributions, far + cell) - p0);
    p1 += t * (gather(scene.distributions, far + cell + 1) - p1);
    real density = i0 * p0 + along * (i1 * p1 - i0 * p0);
    *weight = sel(density > 0.0f, whole * (p0 + along * (p1 - p0)) / max_r(density, (real)(1e-30f)), (real)(0.0f));
    return scene.settings->lambda_min + (to_real(cell) + along) * RERADIATION_STEP;
}

/* The incident wavelengths for a path's outgoing wavelengths: each stays, for light that was reflected, or is drawn
 * from the matrix; *elastic becomes the weight of the event, and *glow zero. All four use the same random number,
 * each a quarter further, so that they stay exchangeable: any of them may be the hero. A
 * wavelength stays in proportion to the light expected either way, but not too seldom: from
 * the third surface on with r^(3/2) at least (0.9 at most), so that the squares of weights shrink by
 * r^(1/2) a bounce, while they could grow for ever between walls that give out much. In a medium r is a share of
 * collisions, which outnumber absorptions: there it is 3 r, as light may be scattered many times. */
#if BSDF_IS_PHASE
#define SHIFT_LEAST(r) (3.0f * (r))
#else
#define SHIFT_LEAST(r) ((r) * sqrt_r(r))
#endif
inline Wavelengths reradiation_shift(Scene scene, integer table, Spectrum *elastic, Spectrum *glow, real amount,
                                     Wavelengths lambdas, real u, integer depth)
{
    real offset = 0.0f;
    Wavelengths into;
#define C(c)                                                                                                    \
    {                                                                                                           \
        real r = elastic->c, g = glow->c * amount, v = u + offset, t, weight = (real)(0.0f);                    \
        v -= floor(v);                                                                                          \
        integer cell = shift_cell(scene, lambdas.c, &t);                                                        \
        real kept = r * shift_between(scene, table + cell, t);                                                  \
        real given = amount * shift_between(scene, table + (SHIFT_CELLS + 1) + cell, t);                        \
        real least = sel(depth > 1, min_r(SHIFT_LEAST(r), (real)(0.9f)), 0.25f * min_r(r, (real)(1.0f)));       \
        real stay = max_r(kept / max_r(kept + given, (real)(1e-20f)), least);                                   \
        stay = sel(g > 0.0f, stay, (real)(1.0f));                                                               \
        mask moves = v >= stay;                                                                                 \
        real go = max_r(1.0f - stay, (real)(1e-7f));                                                            \
        into.c = lambdas.c;                                                                                     \
        if (any(moves))                                                                                         \
            into.c = sel(moves, reradiation_sample(scene, table, lambdas.c, (v - stay) / go, &weight), into.c); \
        elastic->c = sel(moves, amount * weight / go, r / max_r(stay, (real)(1e-20f)));                         \
        glow->c = 0.0f;                                                                                         \
        offset += 0.25f;                                                                                        \
    }
    SPECTRUM_EACH(C)
#undef C
    return into;
}
