/* The stack of an 8-wide tree: each child with the ray's entry distance. */

#define WIDE8_STACK (7 * BVH_DEPTH + 8) /* each node above leaves 7 children waiting */
#define WIDE8_SETS uint waiting[BVH_DEPTH], n = 0; Mask8 sets[BVH_DEPTH];
#define WIDE8_LAST(nodes, node, m, at) wide8_last(nodes, node, m, waiting, sets, &n, at)
#define wide8_next(nodes, r, waiting, waits, t, at) wide8_later(nodes, waiting, waits, t, at)

/* Returns the nearest of the hit children `m` of a node, at least a child, by words and entry distances. Pushes the
 * others in descending order: the entry distance as bits above the word, so that a comparison takes both. */
inline uint wide8_nearest(global const float *nodes, uint at, const uint *entry, Mask8 m, ulong *waiting,
                          uint *waits)
{
    global const uint *words = (global const uint *)(nodes + (ulong)at * 64 + 48);
    uint i = mask8_first(m);
    m &= m - 1;
    if (!m) return words[i];
    ulong near = (ulong)entry[i] << 32 | words[i];
    uint base = *waits, n = base;
    do { /* the nearest is returned */
        i = mask8_first(m);
        m &= m - 1;
        ulong c = (ulong)entry[i] << 32 | words[i];
        ulong far = max(near, c);
        near = min(near, c);
        uint k = n++;
        for (; k > base && waiting[k - 1] < far; k--) waiting[k] = waiting[k - 1];
        waiting[k] = far;
    } while (m);
    *waits = n;
    return (uint)near;
}

/* Pops the last child nearer than t into `at`; returns 0 without such a child. */
inline int wide8_later(global const float *nodes, const ulong *waiting, uint *waits, float t, uint *at)
{
    uint n = *waits;
    do {
        if (!n) return 0;
        n--;
    } while (as_float((uint)(waiting[n] >> 32)) >= t);
    *waits = n;
    *at = (uint)waiting[n];
    return 1;
}

/* Moves from a node to the last of its hit children `m`, with the highest priority, or to a waiting child if `m` is
 * empty. The others are pushed as a set with their node. Returns 0 if nothing waits. */
inline int wide8_last(global const float *nodes, uint node, Mask8 m, uint *waiting, Mask8 *sets, uint *waits,
                      uint *at)
{
    uint n = *waits;
    if (!m) {
        if (!n) return 0;
        node = waiting[--n];
        m = sets[n];
    }
    uint i = mask8_last(m);
    *at = as_uint(nodes[(ulong)node * 64 + 48 + i]);
    waiting[n] = node;
    sets[n] = mask8_without(m, i);
    *waits = n + (sets[n] != 0);
    return 1;
}

/* Tests a block; a hit nearer than t sets t and best, its slot. */
inline void wide8_nearer(global const float *leaves, uint block, const Wide8Ray *r, float *t, uint *best)
{
    union { float8 v; float at[8]; } q;
    float8 det;
    Mask8 m = wide8_triangles(leaves + (ulong)block * 88, r, *t, &q.v, &det);
    if (m) q.v /= det;
    for (; m; m &= m - 1) {
        uint i = mask8_first(m);
        if (q.at[i] < *t) {
            *t = q.at[i];
            *best = block * 8 + i;
        }
    }
}

/* Whether the ray hits a triangle of a block. */
inline int wide8_meets(global const float *leaves, uint block, const Wide8Ray *r, float t)
{
    float8 unused[2];
    return wide8_triangles(leaves + (ulong)block * 88, r, t, &unused[0], &unused[1]) != 0;
}
