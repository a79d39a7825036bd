/* Choosing a point by a grid of cells with a weight at every corner, bilinear in between: a cell by
 * its cumulative sums, the point in it by the bilinear function itself (pbrt-v4, A.5). */
typedef struct {
    integer rows, columns; /* of cells */
    integer faces;         /* the rows are those of so many grids, each with one more row of corners */
    integer corners, marginal, conditional; /* first words in `distributions` */
    real norm;
} Grid;

typedef struct {
    integer row, column;
    vec2 at;  /* in the cell, [0, 1)^2 */
    real pdf; /* per cell area */
} GridPoint;

/* The first of n sums that is above u. */
inline integer grid_search(Scene scene, integer first, integer n, real u)
{
    integer lo = 0, hi = n - 1;
    while (any(lo < hi)) {
        integer mid = (lo + hi) >> 1;
        mask above = gather(scene.distributions, first + mid) > u, open = lo < hi;
        hi = sel_i(above, mid, hi);
        lo = sel_i(open & !above, mid + 1, lo);
    }
    return lo;
}

/* What is left of u in the entry that it chose, in [0, 1). */
inline real grid_rest(Scene scene, integer first, integer i, real u)
{
    real below = gather(scene.distributions, first + max_i(i - 1, (integer)(0)));
    below = sel(i > 0, below, (real)(0.0f));
    real above = gather(scene.distributions, first + i);
    return clamp_r((u - below) / max_r(above - below, (real)(1e-30f)), (real)(0.0f), (real)(0.99999994f));
}

/* x with density proportional to a (1 - x) + b x. */
inline real linear_sample(real u, real a, real b)
{
    real root = sqrt_r(a * a + u * (b * b - a * a)), sum = a + root;
    return min_r(sel(sum > 0.0f, u * (a + b) / max_r(sum, (real)(1e-37f)), u), (real)(0.99999994f));
}

/* Density at a point of a cell, per cell area; `w` are the corners' weights. */
inline void grid_weights(Scene scene, Grid g, integer row, integer column, real w[4])
{
    integer face = to_integer((to_real(row) + 0.5f) * to_real(g.faces) / to_real(g.rows));
    integer first = g.corners + (row + face) * (g.columns + 1) + column;
    w[0] = gather(scene.distributions, first);
    w[1] = gather(scene.distributions, first + 1);
    w[2] = gather(scene.distributions, first + g.columns + 1);
    w[3] = gather(scene.distributions, first + g.columns + 2);
}
inline real grid_density(Grid g, real w[4], vec2 at)
{
    real top = w[0] + at.x * (w[1] - w[0]), bottom = w[2] + at.x * (w[3] - w[2]);
    return (top + at.y * (bottom - top)) * g.norm;
}

inline GridPoint grid_sample(Scene scene, Grid g, vec2 u)
{
    GridPoint p;
    p.row = grid_search(scene, g.marginal, g.rows, u.y);
    integer first = g.conditional + p.row * g.columns;
    p.column = grid_search(scene, first, g.columns, u.x);
    real w[4];
    grid_weights(scene, g, p.row, p.column, w);
    p.at.y = linear_sample(grid_rest(scene, g.marginal, p.row, u.y), w[0] + w[1], w[2] + w[3]);
    p.at.x = linear_sample(grid_rest(scene, first, p.column, u.x), w[0] + p.at.y * (w[2] - w[0]),
                           w[1] + p.at.y * (w[3] - w[1]));
    p.pdf = grid_density(g, w, p.at);
    return p;
}

inline real grid_pdf(Scene scene, Grid g, integer row, integer column, vec2 at)
{
    real w[4];
    grid_weights(scene, g, row, column, w);
    return grid_density(g, w, at);
}

/* Radiance between four texels of four floats, the first of which begins at `first`. */
inline Spectrum texel_at(Scene scene, integer first, integer i, Wavelengths lambdas)
{
    integer at = first + 4 * i;
    return spectrum_light_texel(scene, gather(scene.texels, at), gather(scene.texels, at + 1),
                                gather(scene.texels, at + 2), gather(scene.texels, at + 3), lambdas);
}
inline Spectrum texels_between(Scene scene, integer first, integer i00, integer i10, integer i01, integer i11, vec2 at,
                               Wavelengths lambdas)
{
    Spectrum sum = spectrum_scale(texel_at(scene, first, i00, lambdas), (1.0f - at.x) * (1.0f - at.y));
    sum = spectrum_madd(texel_at(scene, first, i10, lambdas), at.x * (1.0f - at.y), sum);
    sum = spectrum_madd(texel_at(scene, first, i01, lambdas), (1.0f - at.x) * at.y, sum);
    return spectrum_madd(texel_at(scene, first, i11, lambdas), at.x * at.y, sum);
}
