/* The rows in `shapes` of analytic primitives. */

/* Step single: each primitive has a row. */
inline int shape_row_of(Scene scene, int prim) { return scene.settings->first_analytic + prim; }
inline int shape_row_like(Scene scene, int prim) { return shape_row_of(scene, prim); }

/* Step search: the first single_count primitives have a row each; the next rows hold many spheres each, and the number
 * of their first primitive. */
inline int shape_row_of(Scene scene, int prim)
{
    int low = scene.settings->first_analytic + min(prim, scene.settings->single_count);
    int high = prim < scene.settings->single_count ? low : scene.settings->shape_count - 1;
    while (low < high) {
        int middle = (low + high + 1) / 2;
        if (prim < (int)scene.shapes[middle * SHAPE_ROW_WORDS + SHAPE_ROW_PRIM]) high = middle - 1;
        else low = middle;
    }
    return low;
}

/* Step many: primitives that share rows, all of the same kind. */
#include "tracing/shape_rows.cl#search"

/* A row that gives the same hit distance: spheres' rows differ only in uv and sides, and the search for the exact row
 * takes longer. */
inline int shape_row_like(Scene scene, int prim)
{
    return scene.settings->first_analytic + min(prim, scene.settings->single_count);
}

/* Step mixed: primitives that share rows, of two kinds or moving: each hit needs the exact row. */
#include "tracing/shape_rows.cl#search"

inline int shape_row_like(Scene scene, int prim) { return shape_row_of(scene, prim); }
