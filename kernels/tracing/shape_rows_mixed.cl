/* Primitives that share rows, of two kinds or moving: each hit needs the exact row. */
#include "tracing/shape_rows_search.cl"

inline int shape_row_like(Scene scene, int prim) { return shape_row_of(scene, prim); }
