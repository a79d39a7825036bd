/* What the intersect and shadow stages ask of a layout, in lane types; trace_lanes.cl, trace_one.cl and, for
 * `intersect` alone, trace_flights.cl answer it. A ray begins off its surface, so tmin is 0. */
#include "tracing/trace_hit.cl"
