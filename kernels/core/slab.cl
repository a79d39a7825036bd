/* Slabs: structure-of-arrays state, one stream per word. `At` says which slots a work-item serves:
 * LANES neighbours from a first one, or, where QUEUED, any LANES slots by index. */
typedef struct { global float *words; uint stride; } Slab;

#if QUEUED
typedef integer At;
#define slab_read(s, c, at) gather((s).words + (size_t)(c) * (s).stride, at)
#define slab_write(s, c, at, m, v) scatter_if((s).words + (size_t)(c) * (s).stride, at, m, v)
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
