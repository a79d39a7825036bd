/* Primitives that share rows, all of the same kind. */
#include "tracing/shape_rows_search.cl"

/* A row that gives the same hit distance: spheres' rows differ only in uv and sides, and the search for the exact row
 * takes longer. */
inline int shape_row_like(Scene scene, int prim)
{
    return scene.settings->first_analytic + min(prim, scene.settings->single_count);
}
