/* The unit square to itself, so that even points follow a density that is a bilinear table (Dupuy and Jakob 2018,
 * section 4.2). Of every slice `values` has from `first` on its rows of densities per cell, then for every row its
 * integrals up to each column, then the integrals of all rows above each row, which end at 1: of integral 1 each
 * (clpt/measured/warp.py). Density and integrals are linear between slices. */
typedef struct {
    global const float *values;
    integer first, rows, columns;
} WarpTable;

/* Up to four slices, and their shares: two neighbours, and where `wide` two of the next row of slices. */
typedef struct {
    integer index[4];
    real share[4];
    mask wide;
} WarpSlices;

/* A count at the head of a table; where that begins at 0, as in idle lanes, the least, so that what they read
 * exists. */
inline integer warp_count(global const float *values, integer first, int i)
{
    return sel_i(first > 0, to_integer(gather(values, first + i)), (integer)(2));
}

/* A number of every slice, which are `stride` apart. */
inline real warp_read(global const float *values, WarpSlices s, integer at, integer stride)
{
    real r = s.share[0] * gather(values, at + s.index[0] * stride);
    r += s.share[1] * gather(values, at + s.index[1] * stride);
    if (any(s.wide)) {
        r += s.share[2] * gather(values, at + s.index[2] * stride);
        r += s.share[3] * gather(values, at + s.index[3] * stride);
    }
    return r;
}

/* The last of n - 1 numbers that ascend from `first` + `cells` on which is not above x, and how far x is to the next,
 * [0, 1]. Before them stands, for even cells between the first and the last, at which number a cell begins; there is no
 * more than one in a cell. No loop: so compilers see that functions of one pair of directions have it in common. */
inline integer warp_node(global const float *values, integer first, integer cells, integer n, real x, real *along)
{
    integer nodes = first + cells, most = max_i(n - 2, (integer)(0));
    real low = gather(values, nodes), high = gather(values, nodes + n - 1);
    real share = clamp_r((x - low) / max_r(high - low, (real)(1e-20f)), (real)(0.0f), (real)(1.0f));
    integer cell = min_i(to_integer(share * to_real(cells)), cells - 1);
    integer i = clamp_i(to_integer(gather(values, first + cell)), most);
    i = sel_i((i < most) & (gather(values, nodes + i + 1) <= x), i + 1, i);
    real a = gather(values, nodes + i), b = gather(values, nodes + min_i(i + 1, n - 1));
    *along = clamp_r((x - a) / max_r(b - a, (real)(1e-20f)), (real)(0.0f), (real)(1.0f));
    return i;
}

inline integer warp_stride(WarpTable t) { return t.rows * (2 * t.columns + 1); }

/* The cell of a table of n nodes in which x lies, and how far along it. */
inline integer warp_cell(real x, integer n, real *along)
{
    real at = clamp_r(x, (real)(0.0f), (real)(1.0f)) * to_real(n - 1);
    integer cell = min_i(to_integer(at), n - 2);
    *along = at - to_real(cell);
    return cell;
}

/* x with density proportional to a (1 - x) + b x. */
inline real warp_linear(real u, real a, real b)
{
    real root = sqrt_r(a * a + u * (b * b - a * a)), sum = a + root;
    return min_r(sel(sum > 0.0f, u * (a + b) / max_r(sum, (real)(1e-37f)), u), (real)(1.0f));
}

/* The four densities around a cell: of its row, then of the next one. */
inline vec4 warp_corners(WarpTable t, WarpSlices s, integer row, integer column)
{
    integer stride = warp_stride(t), at = t.first + row * t.columns + column;
    return v4(warp_read(t.values, s, at, stride), warp_read(t.values, s, at + 1, stride),
              warp_read(t.values, s, at + t.columns, stride), warp_read(t.values, s, at + t.columns + 1, stride));
}
inline real warp_between(vec4 c, real x, real y)
{
    real a = c.x + y * (c.z - c.x), b = c.y + y * (c.w - c.y);
    return a + x * (b - a);
}
inline real warp_cells(WarpTable t) { return to_real(t.rows - 1) * to_real(t.columns - 1); }

/* The density at a point. */
inline real warp_density(WarpTable t, WarpSlices s, vec2 p)
{
    real x, y;
    integer column = warp_cell(p.x, t.columns, &x), row = warp_cell(p.y, t.rows, &y);
    return warp_between(warp_corners(t, s, row, column), x, y) * warp_cells(t);
}

/* Where an even point goes, and the density there. */
inline vec2 warp_sample(WarpTable t, WarpSlices s, vec2 u, real *density)
{
    integer stride = warp_stride(t), across = t.first + t.rows * t.columns, down = across + t.rows * t.columns;
    u.x = clamp_r(u.x, (real)(1e-7f), (real)(0.9999999f));
    u.y = clamp_r(u.y, (real)(1e-7f), (real)(0.9999999f));
    integer row = 0, high = t.rows - 2;
    while (any(row < high)) {
        integer middle = (row + high + 1) >> 1;
        mask above = warp_read(t.values, s, down + middle, stride) > u.y, open = row < high;
        row = sel_i(open & !above, middle, row);
        high = sel_i(open & above, middle - 1, high);
    }
    integer near = across + row * t.columns, far = near + t.columns;
    real r0 = warp_read(t.values, s, far - 1, stride), r1 = warp_read(t.values, s, far + t.columns - 1, stride);
    real left = u.y - warp_read(t.values, s, down + row, stride);
    real y = warp_linear(clamp_r(left / max_r(0.5f * (r0 + r1), (real)(1e-30f)), (real)(0.0f), (real)(1.0f)), r0, r1);

    real along = u.x * (r0 + y * (r1 - r0));
    integer column = 0;
    high = t.columns - 2;
    while (any(column < high)) {
        integer middle = (column + high + 1) >> 1;
        real a = warp_read(t.values, s, near + middle, stride), b = warp_read(t.values, s, far + middle, stride);
        mask above = a + y * (b - a) > along, open = column < high;
        column = sel_i(open & !above, middle, column);
        high = sel_i(open & above, middle - 1, high);
    }
    real a = warp_read(t.values, s, near + column, stride), b = warp_read(t.values, s, far + column, stride);
    along -= a + y * (b - a);
    vec4 c = warp_corners(t, s, row, column);
    real c0 = c.x + y * (c.z - c.x), c1 = c.y + y * (c.w - c.y);
    real x = warp_linear(clamp_r(along / max_r(0.5f * (c0 + c1), (real)(1e-30f)), (real)(0.0f), (real)(1.0f)), c0, c1);
    *density = (c0 + x * (c1 - c0)) * warp_cells(t);
    vec2 p = {(to_real(column) + x) / to_real(t.columns - 1), (to_real(row) + y) / to_real(t.rows - 1)};
    return p;
}

/* The even point that goes to p, and the density there. */
inline vec2 warp_invert(WarpTable t, WarpSlices s, vec2 p, real *density)
{
    integer stride = warp_stride(t), across = t.first + t.rows * t.columns, down = across + t.rows * t.columns;
    real x, y;
    integer column = warp_cell(p.x, t.columns, &x), row = warp_cell(p.y, t.rows, &y);
    vec4 c = warp_corners(t, s, row, column);
    real c0 = c.x + y * (c.z - c.x), c1 = c.y + y * (c.w - c.y);
    *density = (c0 + x * (c1 - c0)) * warp_cells(t);
    integer near = across + row * t.columns, far = near + t.columns;
    real a = warp_read(t.values, s, near + column, stride), b = warp_read(t.values, s, far + column, stride);
    real r0 = warp_read(t.values, s, far - 1, stride), r1 = warp_read(t.values, s, far + t.columns - 1, stride);
    vec2 u;
    u.x = (a + y * (b - a) + x * (c0 + 0.5f * x * (c1 - c0))) / max_r(r0 + y * (r1 - r0), (real)(1e-30f));
    u.y = warp_read(t.values, s, down + row, stride) + y * (r0 + 0.5f * y * (r1 - r0));
    return u;
}
