/* Slabs: the state of paths, in blocks of SLAB_BLOCK slots. A block has a word of all its slots side by side, then the
 * next word: neighbours read neighbours, and all words of a slot lie at fixed distances from the first, which so is
 * the one address that a work-item keeps. A work-item serves LANES neighbours, from the slot `at` on. */
#define SLAB_BLOCK 32 /* and clpt/layout.py */
typedef struct { global float *words; uint step; } Slab; /* step: words of a slot */

#define slab_at(s, c, at) \
    ((s).words + ((size_t)((at) / SLAB_BLOCK * SLAB_BLOCK) * (s).step + (at) % SLAB_BLOCK) + (c) * SLAB_BLOCK)
#define slab_read(s, c, at) block_load(slab_at(s, c, at))
#define slab_write(s, c, at, m, v) slab_store(slab_at(s, c, at), m, v)
inline void slab_store(global float *p, mask m, real v)
{
#if LANES == 1
    if (m) *p = v;
#else
    block_store(p, sel(m, v, block_load(p)));
#endif
}

/* Where the first words of any slots are. */
inline integer slab_places(Slab s, integer slots)
{
    integer within = slots & (int)(SLAB_BLOCK - 1);
    return (slots - within) * (int)s.step + within;
}

/* Copies word c of any slots to neighbours from `at` on, and back where m. */
inline void slab_gather(Slab s, uint c, integer slots, uint at)
{
    block_store(slab_at(s, c, at), gather(s.words + c * SLAB_BLOCK, slab_places(s, slots)));
}
inline void slab_scatter(Slab s, uint c, uint at, integer slots, mask m)
{
    scatter_if(s.words + c * SLAB_BLOCK, slab_places(s, slots), m, block_load(slab_at(s, c, at)));
}
