/* Hits of shapes beside curves, where there are none: see tracing/curve_others.cl. */
#define curve_others(scene, prim, active, o, d, t, hit) (hit)
#define CURVE_OTHERS 0
