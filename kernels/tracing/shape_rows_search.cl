/* The row in `shapes` of an analytic primitive. The first single_count primitives have a row each; the next rows hold
 * many spheres each, and the number of their first primitive. */
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
