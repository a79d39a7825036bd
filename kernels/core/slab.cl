/* Slabs: structure-of-arrays state, one stream per word. A work-item serves LANES neighbours, from the slot `at` on. */
typedef struct { global float *words; uint stride; } Slab;

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

/* Copies word c of any slots to neighbours from `at` on, and back where m. */
inline void slab_gather(Slab s, uint c, integer slots, uint at)
{
    global float *words = s.words + (size_t)c * s.stride;
    block_store(words + at, gather(words, slots));
}
inline void slab_scatter(Slab s, uint c, uint at, integer slots, mask m)
{
    global float *words = s.words + (size_t)c * s.stride;
    scatter_if(words, slots, m, block_load(words + at));
}
