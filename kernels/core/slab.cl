/* Slabs: structure-of-arrays state, a stream per word. A work-item serves LANES neighbours, from the slot `at` on. */
typedef struct { global float *words; uint step; } Slab;
#if SLAB_BLOCK
/* On GPUs each block of slots has its streams: all words of a slot lie at fixed distances from the first, and a
 * work-item keeps a single address. step: words of a slot. */
#define SLAB_STEP(words_of_slot, stride) words_of_slot
#define slab_at(s, c, at) \
    ((s).words + ((size_t)((at) / SLAB_BLOCK * SLAB_BLOCK) * (s).step + (at) % SLAB_BLOCK) + (c) * SLAB_BLOCK)
#else
#define SLAB_STEP(words_of_slot, stride) stride /* from a word to the next */
#define slab_at(s, c, at) ((s).words + (size_t)(c) * (s).step + (at))
#endif
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

/* Members of several words, from word c on. */
inline vec2 slab_read_vec2(Slab s, uint c, uint at) { return (vec2){slab_read(s, c, at), slab_read(s, c + 1u, at)}; }
inline void slab_write_vec2(Slab s, uint c, uint at, mask m, vec2 v)
{
    slab_write(s, c, at, m, v.x);
    slab_write(s, c + 1u, at, m, v.y);
}
inline vec3 slab_read_vec3(Slab s, uint c, uint at)
{
    return v3(slab_read(s, c, at), slab_read(s, c + 1u, at), slab_read(s, c + 2u, at));
}
inline void slab_write_vec3(Slab s, uint c, uint at, mask m, vec3 v)
{
    slab_write(s, c, at, m, v.x);
    slab_write(s, c + 1u, at, m, v.y);
    slab_write(s, c + 2u, at, m, v.z);
}
inline Spectrum slab_read_spectrum(Slab s, uint c, uint at)
{
    Spectrum r;
#define C(x) r.x = slab_read(s, c++, at);
    SPECTRUM_EACH(C)
#undef C
    return r;
}
inline void slab_write_spectrum(Slab s, uint c, uint at, mask m, Spectrum v)
{
#define C(x) slab_write(s, c++, at, m, v.x);
    SPECTRUM_EACH(C)
#undef C
}
inline Natural3 slab_read_natural3(Slab s, uint c, uint at)
{
    vec3 v = slab_read_vec3(s, c, at);
    return (Natural3){as_natural(v.x), as_natural(v.y), as_natural(v.z)};
}
inline void slab_write_natural3(Slab s, uint c, uint at, mask m, Natural3 v)
{
    slab_write_vec3(s, c, at, m, v3(as_real(v.x), as_real(v.y), as_real(v.z)));
}
inline Fixed slab_read_fixed(Slab s, uint c, uint at)
{
    vec3 v = slab_read_vec3(s, c, at);
    return (Fixed){as_natural(v.x), as_natural(v.y), as_natural(v.z)};
}
inline void slab_write_fixed(Slab s, uint c, uint at, mask m, Fixed v)
{
    slab_write_vec3(s, c, at, m, v3(as_real(v.low), as_real(v.middle), as_real(v.high)));
}

/* Offsets of any slots' words from slot 0's word. */
inline integer slab_places(Slab s, integer slots)
{
#if SLAB_BLOCK
    integer within = slots & (SLAB_BLOCK - 1);
    return (slots - within) * (int)s.step + within;
#else
    return slots;
#endif
}

/* Copy word c of any slots to neighbours from `at` on, and back where m. */
inline void slab_gather(Slab s, uint c, integer slots, uint at)
{
    block_store(slab_at(s, c, at), gather(slab_at(s, c, 0u), slab_places(s, slots)));
}
inline void slab_scatter(Slab s, uint c, uint at, integer slots, mask m)
{
    scatter_if(slab_at(s, c, 0u), slab_places(s, slots), m, block_load(slab_at(s, c, at)));
}
