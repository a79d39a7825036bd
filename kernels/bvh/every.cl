/* Where a traversal puts every hit of a ray, in the order in which it comes to them; null pointers: it
 * only counts. `begin` is the place of the first. */
#include "bvh/hit.cl"

typedef struct { ulong begin; global float *t, *barycentrics; global int *primitive; } Every;

inline void every_put(Every every, uint number, TriHit hit)
{
    if (!every.t) return;
    ulong at = every.begin + number;
    every.t[at] = hit.t;
    every.primitive[at] = as_int(hit.prim);
    every.barycentrics[2 * at] = hit.u;
    every.barycentrics[2 * at + 1] = hit.v;
}
