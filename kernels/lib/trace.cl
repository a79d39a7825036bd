/* What the intersect and shadow stages ask of a layout, in lane types; trace_lanes.cl and trace_one.cl
 * answer it. A ray begins off its surface, so tmin is 0. */
typedef struct {
    real t, u, v;  /* FAR and beyond: nothing */
    vec3 n;        /* see Hit.n in clpt/records.py */
    integer prim;  /* -1: nothing */
    integer shape; /* row in `shapes` */
} TraceHit;
