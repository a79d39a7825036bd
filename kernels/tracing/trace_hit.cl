/* A ray's hit, in lane types. */
typedef struct {
    real t, u, v;  /* FAR and beyond: nothing */
    vec3 n;        /* see Hit.n in clpt/records.py */
    real plane, side; /* see Hit there; 0 off triangles */
    integer prim;  /* -1: nothing */
    integer shape; /* row in `shapes` */
#if USES_INSTANCES
    integer instance; /* see Hit.instance in clpt/records.py */
#endif
} TraceHit;
