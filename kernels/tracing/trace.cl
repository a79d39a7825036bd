/* Queries of the intersect and shadow stages in lane types: `trace_closest` and `trace_occluded`, defined in
 * tracing/trace_lanes.cl, tracing/trace_one.cl and, for `intersect` only, tracing/trace_interleaved.cl. A ray begins
 * off its surface, so tmin is 0. */
#include "tracing/trace_hit.cl"
