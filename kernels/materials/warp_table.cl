/* Warps of the unit square: uniform points take the density of a bilinear table (Dupuy and Jakob 2018, section 4.2).
 * Tables are slices in rows; densities and integrals are linear between slices. From `first` on follow, for every
 * row of slices, with neighbouring slices side by side: for every pair of rows of the table and every column, the
 * densities as two halves in a word; the integrals along both rows up to the column, two words; for cells with equal
 * shares of these integrals, the columns where they begin and end, as two 16383ths in a word; then for every row the
 * integral of all rows above, which ends at 1; and for cells with equal shares of that, the rows where they begin
 * and end (clpt/render/spectra/measurements.py). Words that are read together lie together. */
#include "core/rows.cl"

typedef struct {
    global const float *values;
    integer first, slices, rows, columns; /* slices: of a row, two at least */
    real unit;                            /* of the halves: the mass of a cell where all four are 1 */
} WarpTable;

/* Two neighbouring slices of a row, and where `wide` the same two of another row; their shares. */
typedef struct {
    integer slice, near, far;
    vec2 share, beyond;
    mask wide;
} WarpSlices;

/* A count at the head of a table; where that begins at 0, as in idle lanes, the least, so that what they read
 * exists. */
inline integer warp_count(global const float *values, integer first, int i)
{
    return sel_i(first > 0, to_integer(gather(values, first + i)), (integer)(2));
}

/* The index of the last number up to x among the n - 1 ascending numbers from `first` + `cells`, and the position of
 * x before the next, [0, 1]. Before them lie the first numbers of equal cells between the first and the last number; a
 * cell holds a single number at most. Without a loop compilers see that functions of a pair of
 * directions share this. */
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

/* Words of the pairs of rows for a single quantity; of a row of slices. */
inline integer warp_nodes(WarpTable t) { return (t.rows - 1) * t.columns * t.slices; }
inline integer warp_stride(WarpTable t) { return 4 * warp_nodes(t) + 2 * t.rows * t.slices; }

/* The cell with x in a table of n nodes, and the position of x along it. */
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

inline vec2 warp_mixed(vec2 a, vec2 b, real along)
{
    return (vec2){a.x + along * (b.x - a.x), a.y + along * (b.y - a.y)};
}

inline real warp_at(vec2 rows, real y) { return rows.x + y * (rows.y - rows.x); }

/* A pair of halves, which are not negative, times 2^-112. */
inline vec2 warp_halves(real word)
{
    natural bits = as_natural(word);
    return (vec2){as_real((bits & 0x7fffu) << 13), as_real((bits >> 16 & 0x7fffu) << 13)};
}

/* Of two slices and their shares: of halves in a word each, of pairs, of numbers. */
inline vec2 warp_sum_halves(vec2 share, vec2 words)
{
    vec2 a = warp_halves(words.x), b = warp_halves(words.y);
    return (vec2){share.x * a.x + share.y * b.x, share.x * a.y + share.y * b.y};
}
inline vec2 warp_sum_pairs(vec2 share, vec4 v)
{
    return (vec2){share.x * v.x + share.y * v.z, share.x * v.y + share.y * v.w};
}
inline real warp_sum(vec2 share, vec2 v) { return share.x * v.x + share.y * v.y; }
inline vec2 warp_added(vec2 a, vec2 b) { vec2 r = {a.x + b.x, a.y + b.y}; return r; }

/* The same of all slices; at: where the numbers of the first slice of the first row stand, stride: from row to row. */
inline real warp_read(global const float *values, WarpSlices s, integer at, integer stride)
{
    real r = warp_sum(s.share, gather2(values, at + s.near * stride + s.slice));
    if (any(s.wide)) r += warp_sum(s.beyond, gather2(values, at + s.far * stride + s.slice));
    return r;
}
inline vec2 warp_read_pair(global const float *values, WarpSlices s, integer at, integer stride)
{
    vec2 r = warp_sum_pairs(s.share, gather4(values, at + s.near * stride + 2 * s.slice));
    if (any(s.wide))
        r = warp_added(r, warp_sum_pairs(s.beyond, gather4(values, at + s.far * stride + 2 * s.slice)));
    return r;
}
inline vec2 warp_read_halves(global const float *values, WarpSlices s, integer at, integer stride)
{
    vec2 r = warp_sum_halves(s.share, gather2(values, at + s.near * stride + s.slice));
    if (any(s.wide))
        r = warp_added(r, warp_sum_halves(s.beyond, gather2(values, at + s.far * stride + s.slice)));
    return r;
}

/* Where a share of an integral ends, as a part of it: begin and end of the cell it is in, and how far along. */
inline vec2 warp_ends(real word)
{
    natural bits = as_natural(word);
    return (vec2){to_real(as_integer(bits & 0xffffu)), to_real(as_integer(bits >> 16))};
}
inline real warp_part(vec2 share, vec2 words, real along)
{
    return share.x * warp_at(warp_ends(words.x), along) + share.y * warp_at(warp_ends(words.y), along);
}

/* The node, of n, near which a share of the slices' integral ends: the mean of where it ends in each of them, which is
 * the node itself nineteen times in twenty. at: the cells of the first slice. */
inline integer warp_guess(global const float *values, WarpSlices s, integer at, integer slices, integer stride, real x,
                          integer n)
{
    real cells = x * to_real(n);
    integer cell = clamp_i(to_integer(cells), n - 1), i = at + cell * slices + s.slice;
    real along = cells - to_real(cell);
    real part = warp_part(s.share, gather2(values, i + s.near * stride), along);
    if (any(s.wide)) part += warp_part(s.beyond, gather2(values, i + s.far * stride), along);
    return clamp_i(to_integer(part * (1.0f / 16383.0f) * to_real(n - 1)), n - 2);
}

/* The step toward the cell with x from a node with the integral `below`; `above`: the next node's integral. */
inline integer warp_way(real x, real below, real above, integer node, integer most)
{
    integer forth = sel_i((above <= x) & (node < most), (integer)(1), (integer)(0));
    return sel_i((below > x) & (node > 0), (integer)(-1), forth);
}

/* Densities of two neighbouring rows at two neighbouring columns; integrals of both rows up to the first column. */
inline vec2 warp_densities(WarpTable t, WarpSlices s, integer node)
{
    return warp_read_halves(t.values, s, t.first + node * t.slices, warp_stride(t));
}
inline vec2 warp_across(WarpTable t, WarpSlices s, integer node)
{
    return warp_read_pair(t.values, s, t.first + warp_nodes(t) + 2 * node * t.slices, warp_stride(t));
}
inline real warp_down(WarpTable t, WarpSlices s, integer row)
{
    return warp_read(t.values, s, t.first + 4 * warp_nodes(t) + row * t.slices, warp_stride(t));
}
inline real warp_cells(WarpTable t) { return to_real(t.rows - 1) * to_real(t.columns - 1); }

/* The density at a point. */
inline real warp_density(WarpTable t, WarpSlices s, vec2 p)
{
    real x, y;
    integer column = warp_cell(p.x, t.columns, &x), node = warp_cell(p.y, t.rows, &y) * t.columns + column;
    vec2 c = warp_mixed(warp_densities(t, s, node), warp_densities(t, s, node + 1), x);
    return warp_at(c, y) * t.unit * warp_cells(t);
}

/* Where an even point goes, and the density there. */
inline vec2 warp_sample(WarpTable t, WarpSlices s, vec2 u, real *density)
{
    integer stride = warp_stride(t), nodes = warp_nodes(t), guide = t.first + 4 * nodes + t.rows * t.slices;
    u.x = clamp_r(u.x, (real)(1e-7f), (real)(0.9999999f));
    u.y = clamp_r(u.y, (real)(1e-7f), (real)(0.9999999f));
    integer row = warp_guess(t.values, s, guide, t.slices, stride, u.y, t.rows);
    real below = warp_down(t, s, row), above = warp_down(t, s, row + 1);
    integer way = warp_way(u.y, below, above, row, t.rows - 2);
    while (any(way != 0)) {
        row += way;
        real next = warp_down(t, s, sel_i(way > 0, row + 1, row)), old = above;
        above = sel(way < 0, below, sel(way > 0, next, above));
        below = sel(way < 0, next, sel(way > 0, old, below));
        way = warp_way(u.y, below, above, row, t.rows - 2);
    }
    integer begin = row * t.columns;
    vec2 whole = warp_across(t, s, begin + t.columns - 1);
    real left = clamp_r((u.y - below) / max_r(0.5f * (whole.x + whole.y), (real)(1e-30f)), (real)(0.0f), (real)(1.0f));
    real y = warp_linear(left, whole.x, whole.y);

    real along = u.x * warp_at(whole, y);
    guide = t.first + 3 * nodes + begin * t.slices;
    integer column = warp_guess(t.values, s, guide, t.slices, stride, u.x, t.columns);
    below = warp_at(warp_across(t, s, begin + column), y);
    above = warp_at(warp_across(t, s, begin + column + 1), y);
    way = warp_way(along, below, above, column, t.columns - 2);
    while (any(way != 0)) {
        column += way;
        real next = warp_at(warp_across(t, s, begin + sel_i(way > 0, column + 1, column)), y), old = above;
        above = sel(way < 0, below, sel(way > 0, next, above));
        below = sel(way < 0, next, sel(way > 0, old, below));
        way = warp_way(along, below, above, column, t.columns - 2);
    }
    integer node = begin + column;
    along -= below;
    real c0 = warp_at(warp_densities(t, s, node), y) * t.unit;
    real c1 = warp_at(warp_densities(t, s, node + 1), y) * t.unit;
    real x = warp_linear(clamp_r(along / max_r(0.5f * (c0 + c1), (real)(1e-30f)), (real)(0.0f), (real)(1.0f)), c0, c1);
    *density = (c0 + x * (c1 - c0)) * warp_cells(t);
    return (vec2){(to_real(column) + x) / to_real(t.columns - 1), (to_real(row) + y) / to_real(t.rows - 1)};
}

/* The even point that goes to p, and the density there. */
inline vec2 warp_invert(WarpTable t, WarpSlices s, vec2 p, real *density)
{
    real x, y;
    integer column = warp_cell(p.x, t.columns, &x), row = warp_cell(p.y, t.rows, &y), begin = row * t.columns;
    integer node = begin + column;
    real c0 = warp_at(warp_densities(t, s, node), y) * t.unit;
    real c1 = warp_at(warp_densities(t, s, node + 1), y) * t.unit;
    *density = (c0 + x * (c1 - c0)) * warp_cells(t);
    vec2 before = warp_across(t, s, node), whole = warp_across(t, s, begin + t.columns - 1);
    vec2 u;
    u.x = (warp_at(before, y) + x * (c0 + 0.5f * x * (c1 - c0))) / max_r(warp_at(whole, y), (real)(1e-30f));
    u.y = warp_down(t, s, row) + y * (whole.x + 0.5f * y * (whole.y - whole.x));
    return u;
}

/* Halfway directions as points of the unit square (Dupuy and Jakob 2018, section 4.1): x is the root of the angle to z,
 * y the azimuth, each over its range. */
inline vec2 halfway_square(vec3 w)
{
    real theta = atan2_r(sqrt_r(w.x * w.x + w.y * w.y), w.z);
    return (vec2){sqrt_r(theta * (2.0f * INV_PI)), (atan2_r(w.y, w.x) + PI) * INV_2PI};
}

/* A point's direction; its azimuth is turned by so many full turns. */
inline vec3 halfway_direction(vec2 p, real turned)
{
    real turn = p.y + 0.5f + turned, sin_p, cos_p, sin_t, cos_t;
    sincos_2pi(turn - floor(turn), &sin_p, &cos_p);
    sincos_2pi(0.25f * p.x * p.x, &sin_t, &cos_t);
    return v3(cos_p * sin_t, sin_p * sin_t, cos_t);
}

/* Solid angle of wi over area of the square, at x; h: the halfway direction there, cos_o: its cosine to wo. */
inline real halfway_area(real x, vec3 h, real cos_o)
{
    real sin_m = sqrt_r(h.x * h.x + h.y * h.y);
    return max_r(2.0f * PI * PI * x * sin_m, (real)(1e-6f)) * 4.0f * max_r(cos_o, (real)(1e-6f));
}
