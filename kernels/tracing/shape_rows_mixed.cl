/* The same where primitives without a row of their own are of two kinds or move: each needs its row to be met. */
#include "tracing/shape_rows_search.cl"

inline int shape_row_like(Scene scene, int prim) { return shape_row_of(scene, prim); }
