/* Interleaved rays through the 8-wide tree: each steps to its next node or block in turn, whose memory is prefetched
 * while the other rays step. This pays for incoherent rays in a tree larger than the caches. */
#include "bvh/fetch.cl"
#include "bvh/wide8.cl"

typedef struct {
    Wide8Ray ray;
    float t; /* tmax, or the nearest distance so far */
    uint at, waits, best;
    union {
        ulong nearest[WIDE8_STACK];
        struct { uint nodes[BVH_DEPTH]; Mask8 sets[BVH_DEPTH]; } last;
    } waiting;
} Wide8RayState;

/* Whether two rays' directions are within 13 degrees, by the squared cosine. */
inline int wide8_alike(float3 a, float3 b)
{
    float along = dot(a, b);
    return along > 0.0f && along * along > 0.95f * dot(a, a) * dot(b, b);
}

/* Prefetches the cache lines of a node or a block. */
inline void wide8_fetch(global const float *nodes, global const float *leaves, uint at)
{
    global const float *from = at & BVH_LEAF ? leaves + (ulong)(at & ~BVH_LEAF) * 88 : nodes + (ulong)at * 64;
    for (uint line = 0; line < 5; line++) FETCH(from + 16 * line);
}

/* Starts a ray; returns 0 if it is not finite and hits nothing. */
inline int wide8_start(Wide8RayState *s, float ox, float oy, float oz, float dx, float dy, float dz, float tmin,
                       float tmax)
{
    s->t = tmax;
    s->at = s->waits = 0;
    s->best = BVH_MISS;
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return 0;
    s->ray = wide8_ray(ox, oy, oz, dx, dy, dz, tmin);
    return 1;
}

/* The next node or block of a ray for its nearest hit; returns 0 at the end, where wide8_finish returns the hit. */
inline int wide8_step(global const float *nodes, global const float *leaves, Wide8RayState *s)
{
    uint at = s->at;
    Mask8 m = 0;
    if (at & BVH_LEAF) {
        wide8_nearer(leaves, at & ~BVH_LEAF, &s->ray, &s->t, &s->best);
    } else {
        union { float8 v; uint at[8]; } entry;
        m = wide8_boxes(nodes + (ulong)at * 64, &s->ray, s->t, &entry.v);
        if (m) at = wide8_nearest(nodes, at, entry.at, m, s->waiting.nearest, &s->waits);
    }
    if (!m && !wide8_later(nodes, s->waiting.nearest, &s->waits, s->t, &at)) return 0;
    s->at = at;
    wide8_fetch(nodes, leaves, at);
    return 1;
}

inline TriHit wide8_finish(global const float *leaves, const Wide8RayState *s)
{
    return s->best == BVH_MISS ? tri_miss(s->t) : wide8_hit(leaves, s->best, s->t, &s->ray);
}

/* The next node or block of a ray for any hit; returns 0 at the end, where `best` is BVH_MISS without a hit. */
inline int wide8_step_any(global const float *nodes, global const float *leaves, Wide8RayState *s)
{
    uint at = s->at;
    Mask8 m = 0;
    float8 unused[2];
    if (at & BVH_LEAF) {
        uint block = at & ~BVH_LEAF;
        if (wide8_triangles(leaves + (ulong)block * 88, &s->ray, s->t, &unused[0], &unused[1])) {
            s->best = block;
            return 0;
        }
    } else {
        m = wide8_boxes(nodes + (ulong)at * 64, &s->ray, s->t, &unused[0]);
    }
    if (!wide8_last(nodes, at, m, s->waiting.last.nodes, s->waiting.last.sets, &s->waits, &s->at)) return 0;
    wide8_fetch(nodes, leaves, s->at);
    return 1;
}
