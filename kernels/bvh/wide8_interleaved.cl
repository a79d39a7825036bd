/* Rays through the 8-wide tree with several of them in flight: each goes one node or block on in turn, and
 * what it needs next is fetched while the others move. That pays where rays of all directions wait for
 * memory, in a tree larger than the caches.
 */
#include "bvh/fetch.cl"
#include "bvh/wide8.cl"

typedef struct {
    Wide8Ray ray;
    float t; /* tmax, or where the nearest so far is */
    uint at, waits, best;
    union {
        ulong nearest[WIDE8_STACK];
        struct { uint nodes[BVH_DEPTH]; Mask8 sets[BVH_DEPTH]; } last;
    } waiting;
} Wide8RayState;

/* Whether two rays look about the same way: the squared cosine is of 13 degrees. */
inline int wide8_alike(float3 a, float3 b)
{
    float along = dot(a, b);
    return along > 0.0f && along * along > 0.95f * dot(a, a) * dot(b, b);
}

/* Asks for the lines of memory that a node or a block fills. */
inline void wide8_fetch(global const float *nodes, global const float *leaves, uint at)
{
    global const float *from = at & BVH_LEAF ? leaves + (ulong)(at & ~BVH_LEAF) * 88 : nodes + (ulong)at * 64;
    for (uint line = 0; line < 5; line++) FETCH(from + 16 * line);
}

/* 0 if it is no ray, and meets nothing. */
inline int wide8_start(Wide8RayState *f, float ox, float oy, float oz, float dx, float dy, float dz, float tmin,
                        float tmax)
{
    f->t = tmax;
    f->at = f->waits = 0;
    f->best = BVH_MISS;
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return 0;
    f->ray = wide8_ray(ox, oy, oz, dx, dy, dz, tmin);
    return 1;
}

/* One node or block on, of a ray that looks for the nearest hit; 0 at the end, where wide8_finish tells it. */
inline int wide8_step(global const float *nodes, global const float *leaves, Wide8RayState *f)
{
    uint at = f->at;
    Mask8 m = 0;
    if (at & BVH_LEAF) {
        wide8_nearer(leaves, at & ~BVH_LEAF, &f->ray, &f->t, &f->best);
    } else {
        union { float8 v; uint at[8]; } entry;
        global const float *node = nodes + (ulong)at * 64;
        m = wide8_boxes(node, &f->ray, f->t, &entry.v);
        if (m)
            at = wide8_nearest((global const uint *)(node + 48), entry.at, m, f->waiting.nearest, &f->waits);
    }
    if (!m && !wide8_next(f->waiting.nearest, &f->waits, f->t, &at)) return 0;
    f->at = at;
    wide8_fetch(nodes, leaves, at);
    return 1;
}

inline TriHit wide8_finish(global const float *leaves, const Wide8RayState *f)
{
    return f->best == BVH_MISS ? tri_miss(f->t) : wide8_hit(leaves, f->best, f->t, &f->ray);
}

/* One node or block on, of a ray that looks for any hit; 0 at the end, where `best` is not BVH_MISS if there
 * is one. */
inline int wide8_step_any(global const float *nodes, global const float *leaves, Wide8RayState *f)
{
    uint at = f->at;
    Mask8 m = 0;
    float8 unused[2];
    if (at & BVH_LEAF) {
        uint block = at & ~BVH_LEAF;
        if (wide8_triangles(leaves + (ulong)block * 88, &f->ray, f->t, &unused[0], &unused[1])) {
            f->best = block;
            return 0;
        }
    } else {
        m = wide8_boxes(nodes + (ulong)at * 64, &f->ray, f->t, &unused[0]);
    }
    if (!wide8_last(nodes, at, m, f->waiting.last.nodes, f->waiting.last.sets, &f->waits, &f->at)) return 0;
    wide8_fetch(nodes, leaves, f->at);
    return 1;
}
