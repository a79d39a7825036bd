/* Primitives without a row of their own, where these are of one kind. */
#include "tracing/shape_rows_search.cl"

/* A row with which the primitive is met at the same distance: spheres differ in it only by what their uv
 * and sides are, and finding theirs takes longer. */
inline int shape_row_like(Scene scene, int prim)
{
    return scene.settings->first_analytic + min(prim, scene.settings->single_count);
}
