/* The arrays for all hits of a ray, in the traversal's order. With null pointers a traversal only counts. `begin` is
 * the index of the ray's first hit. */
#include "bvh/hit.cl"

typedef struct { ulong begin; global float *t, *barycentrics; global int *primitive; } HitList;

inline void hit_list_put(HitList list, uint number, TriHit hit)
{
    if (!list.t) return;
    ulong at = list.begin + number;
    list.t[at] = hit.t;
    list.primitive[at] = as_int(hit.prim);
    list.barycentrics[2 * at] = hit.u;
    list.barycentrics[2 * at + 1] = hit.v;
}
