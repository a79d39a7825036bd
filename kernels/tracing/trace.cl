/* What the intersect and shadow stages ask of a layout, in lane types: `trace_closest` and `trace_occluded`. They
 * stand in tracing/trace_lanes.cl, tracing/trace_one.cl and, for `intersect` alone, tracing/trace_interleaved.cl. A ray
 * begins off its surface, so tmin is 0. */
#include "tracing/trace_hit.cl"
