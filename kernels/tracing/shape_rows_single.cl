/* The row in `shapes` of an analytic primitive, if each has a row. */
inline int shape_row_of(Scene scene, int prim) { return scene.settings->first_analytic + prim; }
inline int shape_row_like(Scene scene, int prim) { return shape_row_of(scene, prim); }
