/* The row in `shapes` of an analytic primitive. The first single_count ones have a row each; behind them
 * the rows are of many spheres, and say at which primitive theirs begin. */
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
