/* Slabs: structure-of-arrays state, one stream per word. `At` says which slots a work-item serves:
 * LANES neighbours from a first one, or, where QUEUED, any LANES slots by index. */
typedef struct { global float *words; uint stride; } Slab;

#if QUEUED
typedef integer At;
#define slab_read(s, c, at) gather((s).words + (size_t)(c) * (s).stride, at)
/* A queue's last work-item repeats its last slot in idle lanes: equal values, no mask needed. */
#define slab_write(s, c, at, m, v) slab_scatter((s).words + (size_t)(c) * (s).stride, at, m, v)
inline void slab_scatter(global float *p, integer at, mask m, real v)
{
#if LANES == 1
    if (m) p[at] = v;
#else
    real old = gather(p, at);
    scatter(p, at, sel(m, v, old));
#endif
}
#else
typedef uint At;
#define slab_read(s, c, at) block_load((s).words + (size_t)(c) * (s).stride + (at))
#define slab_write(s, c, at, m, v) slab_store((s).words + (size_t)(c) * (s).stride + (at), m, v)
inline void slab_store(global float *p, mask m, real v)
{
#if LANES == 1
    if (m) *p = v;
#else
    block_store(p, sel(m, v, block_load(p)));
#endif
}
#endif
