/* Choosing a direction by a grid of cells with a weight at every corner, bilinear in between: a block of cells by its
 * weight times the cosine to a receiver's normal, a cell in it by cumulative sums, the point in that by the bilinear
 * function itself (pbrt-v4, A.5). Blocks lie in bands of rows and in strips of columns. The cosines are those of many
 * normals together, GRID_SIDE^2 parts of the octahedron, and none for a receiver on both sides of its surface. */
#include "generated/grid_sizes.cl"

typedef struct {
    integer rows, columns; /* number of cells */
    integer faces;         /* number of grids that share the rows, each with an additional row of corners */
    integer corners;       /* first word in `distributions` of the corners' weights */
    integer marginal;      /* first word of sums over a block's rows, for every strip; 1 at its end */
    integer conditional;   /* first word of sums over a block's columns, for every row; 1 at its end */
    integer blocks;        /* first word of the tables of `grid_receiver` */
    integer block_rows, block_columns; /* cells of a block */
    real norm;
} Grid;

/* The number of blocks for a number of cells. */
inline integer grid_blocks(integer cells, integer block)
{
    return to_integer((to_real(cells + block) - 0.5f) / to_real(block));
}

/* The first word of a receiver's tables: sums over bands, 1 at the end; for every band sums over its strips, 1 at the
 * end; and for every block its probability over the probability by weight only. n: unit normal in the grid's axes. */
inline integer grid_receiver(Grid g, mask given, vec3 n)
{
    integer down = grid_blocks(g.rows, g.block_rows), across = grid_blocks(g.columns, g.block_columns);
    real over = 1.0f / max_r(fabs(n.x) + fabs(n.y) + fabs(n.z), (real)(1e-20f)), x = n.x * over, y = n.y * over;
    mask back = n.z < 0.0f;
    real u = sel(back, (1.0f - fabs(y)) * sel(x < 0.0f, (real)(-1.0f), (real)(1.0f)), x);
    real v = sel(back, (1.0f - fabs(x)) * sel(y < 0.0f, (real)(-1.0f), (real)(1.0f)), y);
    integer i = clamp_i(to_integer((u + 1.0f) * (0.5f * GRID_SIDE)), (integer)(GRID_SIDE - 1));
    integer j = clamp_i(to_integer((v + 1.0f) * (0.5f * GRID_SIDE)), (integer)(GRID_SIDE - 1));
    integer part = sel_i(given, j * GRID_SIDE + i, (integer)(GRID_SIDE * GRID_SIDE));
    return g.blocks + part * (down + 2 * down * across);
}

typedef struct {
    integer row, column;
    vec2 at;  /* in the cell, [0, 1)^2 */
    real pdf; /* per cell area */
} GridPoint;

/* The first of n sums above u. */
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

/* u rescaled within its chosen entry, in [0, 1). */
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
    vec2 top = gather2(scene.distributions, first), bottom = gather2(scene.distributions, first + g.columns + 1);
    w[0] = top.x;
    w[1] = top.y;
    w[2] = bottom.x;
    w[3] = bottom.y;
}
inline real cell_density(Grid g, real w[4], vec2 at)
{
    real top = w[0] + at.x * (w[1] - w[0]), bottom = w[2] + at.x * (w[3] - w[2]);
    return (top + at.y * (bottom - top)) * g.norm;
}

/* receiver: of grid_receiver. */
inline GridPoint grid_sample(Scene scene, Grid g, integer receiver, vec2 u)
{
    GridPoint p;
    integer down = grid_blocks(g.rows, g.block_rows), across = grid_blocks(g.columns, g.block_columns);
    integer band = grid_search(scene, receiver, down, u.y), strips = receiver + down + band * across;
    integer strip = grid_search(scene, strips, across, u.x);
    u.y = grid_rest(scene, receiver, band, u.y);
    u.x = grid_rest(scene, strips, strip, u.x);
    integer top = band * g.block_rows, rows = g.marginal + strip * g.rows + top;
    integer row = grid_search(scene, rows, min_i(g.block_rows, g.rows - top), u.y);
    p.row = top + row;
    integer left = strip * g.block_columns, columns = g.conditional + p.row * g.columns + left;
    integer column = grid_search(scene, columns, min_i(g.block_columns, g.columns - left), u.x);
    p.column = left + column;
    real w[4];
    grid_weights(scene, g, p.row, p.column, w);
    p.at.y = linear_sample(grid_rest(scene, rows, row, u.y), w[0] + w[1], w[2] + w[3]);
    p.at.x = linear_sample(grid_rest(scene, columns, column, u.x), w[0] + p.at.y * (w[2] - w[0]),
                           w[1] + p.at.y * (w[3] - w[1]));
    p.pdf = cell_density(g, w, p.at) * gather(scene.distributions, strips + strip + down * across);
    return p;
}

inline real grid_pdf(Scene scene, Grid g, integer receiver, integer row, integer column, vec2 at)
{
    integer down = grid_blocks(g.rows, g.block_rows), across = grid_blocks(g.columns, g.block_columns);
    integer band = to_integer((to_real(row) + 0.5f) / to_real(g.block_rows));
    integer strip = to_integer((to_real(column) + 0.5f) / to_real(g.block_columns));
    real w[4];
    grid_weights(scene, g, row, column, w);
    return cell_density(g, w, at) * gather(scene.distributions, receiver + down + (down + band) * across + strip);
}

/* Radiance of a texel of four floats; texel 0 begins at `first`. */
inline Spectrum texel_at(Scene scene, integer first, integer i, Wavelengths lambdas)
{
    vec4 texel = gather4(scene.texels, first + 4 * i);
    return spectrum_light_texel(scene, texel.x, texel.y, texel.z, texel.w, lambdas);
}
#include "core/grid.cl#texels_at_once"

/* Step texels_at_once: radiance between four texels, whose numbers are i00 to i11; at: in the square between them. */
inline Spectrum texels_between(Scene scene, integer first, integer i00, integer i10, integer i01, integer i11, vec2 at,
                               Wavelengths lambdas)
{
    Spectrum sum = spectrum_scale(texel_at(scene, first, i00, lambdas), (1.0f - at.x) * (1.0f - at.y));
    sum = spectrum_madd(texel_at(scene, first, i10, lambdas), at.x * (1.0f - at.y), sum);
    sum = spectrum_madd(texel_at(scene, first, i01, lambdas), (1.0f - at.x) * at.y, sum);
    return spectrum_madd(texel_at(scene, first, i11, lambdas), at.x * at.y, sum);
}

/* Step texels_in_turn: the same texel by texel: four spectra at once need too many of a GPU's registers. */
inline Spectrum texels_between(Scene scene, integer first, integer i00, integer i10, integer i01, integer i11, vec2 at,
                               Wavelengths lambdas)
{
    Spectrum sum = spectrum_of((real)(0.0f));
    ROLLED
    for (int k = 0; k < 4; k++) {
        integer i = k & 2 ? (k & 1 ? i11 : i01) : (k & 1 ? i10 : i00);
        real share = (k & 1 ? at.x : 1.0f - at.x) * (k & 2 ? at.y : 1.0f - at.y);
        sum = spectrum_madd(texel_at(scene, first, i, lambdas), share, sum);
    }
    return sum;
}
