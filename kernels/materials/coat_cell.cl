/* Reads the tables of integrals over facets by roughness and index, and by a cosine: linear in the roots of alpha and
 * of 1 - 1 / eta. */
#include "generated/coat_nodes.cl"

/* A node of the tables by roughness and index, and the distances to the next nodes. */
typedef struct {
    integer row, column;
    real by_alpha, by_index;
} CoatCell;

inline CoatCell coat_cell(Microfacets d, real eta)
{
    CoatCell cell;
    real x = sqrt(min_r(d.alpha_u, (real)(1.0f))) * (float)(COAT_ALPHAS - 1);
    real y = min_r(sqrt_r(1.0f - 1.0f / eta) * COAT_INDEX_SCALE, (real)(COAT_INDICES - 1));
    cell.row = clamp_i(to_integer(x), (integer)(COAT_ALPHAS - 2));
    cell.column = clamp_i(to_integer(y), (integer)(COAT_INDICES - 2));
    cell.by_alpha = x - to_real(cell.row);
    cell.by_index = y - to_real(cell.column);
    cell.row = sel_i(d.beckmann, cell.row + COAT_ALPHAS, cell.row);
    return cell;
}
/* A word's two numbers, interpolated by the distance from the first. */
inline real coat_pair(constant uint *table, integer at, real next)
{
    integer word = gather_constant(table, at);
    real a = to_real(word & 0xffff);
    return a + next * (to_real((word >> 16) & 0xffff) - a);
}
inline real coat_look_up(constant uint *table, CoatCell cell)
{
    integer at = cell.row * (COAT_INDICES - 1) + cell.column;
    real a = coat_pair(table, at, cell.by_index), b = coat_pair(table, at + (COAT_INDICES - 1), cell.by_index);
    return a + cell.by_alpha * (b - a);
}

/* Of a table by `nodes` cosines too; by: how far beyond the k-th. */
inline real coat_look_up_by(constant uint *table, int nodes, CoatCell cell, integer k, real by)
{
    integer at = (cell.row * COAT_INDICES + cell.column) * (nodes - 1) + k;
    real t[4];
#pragma unroll
    for (int corner = 0; corner < 4; corner++)
        t[corner] = coat_pair(table, at + ((corner >> 1) * COAT_INDICES + (corner & 1)) * (nodes - 1), by);
    t[0] += cell.by_index * (t[1] - t[0]);
    t[2] += cell.by_index * (t[3] - t[2]);
    return t[0] + cell.by_alpha * (t[2] - t[0]);
}
