/* The stack of an 8-wide tree, and the test of a block. */

/* Step. */
/* The stack holds each child with the ray's entry distance. */
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

/* Step levels: for devices without vectors, such as GPUs, the stack takes 8 bytes a level: a node in the low word, its
 * waiting children in the high word. A popped child's box is tested again. */
#define WIDE8_STACK (BVH_LEVELS - 1) /* each level above the last leaves a node waiting */
#define WIDE8_SETS ulong waiting[WIDE8_STACK]; uint n = 0;
#define WIDE8_LAST(nodes, node, m, at) wide8_last(nodes, node, m, waiting, &n, at)
#define WIDE8_LESSER(type, i, j)             \
    {                                        \
        type lesser = min(k.s##i, k.s##j);   \
        k.s##j = max(k.s##i, k.s##j);        \
        k.s##i = lesser;                     \
    }

/* The slots of the hit children `m`, three bits each, the nearest lowest, below a terminating bit. A network sorts them
 * (Knuth 1998, sec. 5.3.4) by entry distance, up to 7 parts in 2^23. */
inline uint wide8_order(uint8 entry, Mask8 m)
{
    const uint8 slots = (uint8)(0, 1, 2, 3, 4, 5, 6, 7);
    uint8 k = ((uint8)(m) >> slots & 1u) != 0u ? (entry & ~7u) | slots : (uint8)(~0u);
    WIDE8_LESSER(uint4, 0145, 2367)
    WIDE8_LESSER(uint4, 0123, 4567)
    WIDE8_LESSER(uint4, 0246, 1357)
    WIDE8_LESSER(uint2, 23, 45)
    WIDE8_LESSER(uint2, 13, 46)
    WIDE8_LESSER(uint4, 1350, 2467)
    uint4 two = (k.even & 7u) | (k.odd & 7u) << 3;
    uint ends = 1u << 3 * popcount(m);
    return ((two.x | two.y << 6 | two.z << 12 | two.w << 18) & (ends - 1)) | ends;
}

/* Returns the word of the first child of a non-empty list; pushes the others with their node. */
inline uint wide8_first(global const float *nodes, uint node, uint list, ulong *waiting, uint *waits)
{
    if (list >> 3 > 1) waiting[(*waits)++] = (ulong)(list >> 3) << 32 | node;
    return as_uint(nodes[(ulong)node * 64 + 48 + (list & 7)]);
}

/* The nearest of the hit children `m` of a node, at least a child; entry: their distances as bits. */
inline uint wide8_nearest(global const float *nodes, uint at, const uint *entry, Mask8 m, ulong *waiting, uint *waits)
{
    return wide8_first(nodes, at, wide8_order(vload8(0, entry), m), waiting, waits);
}

/* Pops the last child into `at`, at any distance; returns 0 without a child. */
inline int wide8_later(global const float *nodes, ulong *waiting, uint *waits, float t, uint *at)
{
    if (!*waits) return 0;
    ulong top = waiting[--*waits];
    *at = wide8_first(nodes, (uint)top, (uint)(top >> 32), waiting, waits);
    return 1;
}

/* Whether the ray hits a child's box between tmin and t; box: its slot in the node. */
inline int wide8_enters(global const float *box, const Wide8Ray *r, float t)
{
    float x = box[8 * r->nx] * r->rx + r->px, far_x = box[8 * (r->nx ^ 1)] * r->fx + r->gx;
    float y = box[8 * r->ny] * r->ry + r->py, far_y = box[8 * (r->ny ^ 1)] * r->fy + r->gy;
    float z = box[8 * r->nz] * r->rz + r->pz, far_z = box[8 * (r->nz ^ 1)] * r->fz + r->gz;
    return fmax(fmax(x, y), fmax(z, r->tmin)) <= fmin(fmin(far_x, far_y), fmin(far_z, t));
}

/* Pops the last child nearer than t into `at`; returns 0 without such a child. */
inline int wide8_next(global const float *nodes, const Wide8Ray *r, ulong *waiting, uint *waits, float t, uint *at)
{
    ulong top;
    do {
        if (!*waits) return 0;
        top = waiting[*waits - 1];
        wide8_later(nodes, waiting, waits, t, at);
    } while (!wide8_enters(nodes + (ulong)(uint)top * 64 + (top >> 32 & 7), r, t));
    return 1;
}

/* Moves from a node to the last of its hit children `m`, with the highest priority, or to a waiting child if `m` is
 * empty. The others are pushed as a set. Returns 0 if nothing waits. */
inline int wide8_last(global const float *nodes, uint node, Mask8 m, ulong *waiting, uint *waits, uint *at)
{
    ulong top = (ulong)m << 32 | node;
    if (!m) {
        if (!*waits) return 0;
        top = waiting[--*waits];
    }
    uint i = mask8_last((Mask8)(top >> 32));
    *at = as_uint(nodes[(ulong)(uint)top * 64 + 48 + i]);
    top ^= 1ul << (32 + i);
    if (top >> 32) waiting[(*waits)++] = top;
    return 1;
}

/* Whether the ray hits triangle `b` of a block between tmin and t, see wide8_triangles; its distance times `det`. */
inline int wide8_triangle(global const float *b, const Wide8Ray *r, float t, float *distance, float *det)
{
    const Shear *s = &r->shear;
    float az = b[8 * s->kz] - s->oz, bz = b[24 + 8 * s->kz] - s->oz, cz = b[48 + 8 * s->kz] - s->oz;
    float ax = b[8 * s->kx] - s->ox - s->x * az, ay = b[8 * s->ky] - s->oy - s->y * az;
    float bx = b[24 + 8 * s->kx] - s->ox - s->x * bz, by = b[24 + 8 * s->ky] - s->oy - s->y * bz;
    float cx = b[48 + 8 * s->kx] - s->ox - s->x * cz, cy = b[48 + 8 * s->ky] - s->oy - s->y * cz;
    float u = shear_edge(cx, cy, bx, by), v = shear_edge(ax, ay, cx, cy), w = shear_edge(bx, by, ax, ay);
    int inside = ((u >= 0.0f) & (v >= 0.0f) & (w >= 0.0f)) | ((u <= 0.0f) & (v <= 0.0f) & (w <= 0.0f));
    float sum = u + v + w, q = (u * az + v * bz + w * cz) * s->z;
    *det = fabs(sum);
    *distance = sum < 0.0f ? -q : q;
    return inside & (*distance > r->tmin * *det) & (*distance < t * *det);
}

/* Tests a block; a hit nearer than t sets t and best, its slot. Two triangles at a time need .6 of the registers of
 * eight. */
inline void wide8_nearer(global const float *leaves, uint block, const Wide8Ray *r, float *t, uint *best)
{
    float far = *t;
#pragma unroll 2
    for (uint i = 0; i < 8; i++) {
        float q, det;
        if (!wide8_triangle(leaves + (ulong)block * 88 + i, r, far, &q, &det)) continue;
        float near = q / det;
        *best = near < *t ? block * 8 + i : *best;
        *t = near < *t ? near : *t;
    }
}

/* Whether the ray hits a triangle of a block. */
inline int wide8_meets(global const float *leaves, uint block, const Wide8Ray *r, float t)
{
    int met = 0;
#pragma unroll 2
    for (uint i = 0; i < 8; i++) {
        float q, det;
        met |= wide8_triangle(leaves + (ulong)block * 88 + i, r, t, &q, &det);
    }
    return met;
}
