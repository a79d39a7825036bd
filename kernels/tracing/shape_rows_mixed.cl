/* The same where primitives without a row of their own are of two kinds or move: each needs its row to be met. */
#include "tracing/shape_rows_many.cl"
#define shape_row_like shape_row_of
