/* Random numbers as hashes of counters: a number depends on its arguments only, there is no state. */

/* PCG's output permutation (Jarzynski and Olano 2020). */
inline natural hash_natural(natural x)
{
    x = x * 747796405u + 2891336453u;
    x = ((x >> ((x >> 28u) + 4u)) ^ x) * 277803737u;
    return (x >> 22u) ^ x;
}
/* [0, 1): 23 bits put into a mantissa, so that 1 never comes out. */
#define UNIT_GRAIN 0x1p-23f
inline real unit_interval(natural x) { return as_real((x >> 9u) | 0x3f800000u) - 1.0f; }

inline natural reverse_bits(natural x)
{
    x = (x << 16u) | (x >> 16u);
    x = ((x & 0x00ff00ffu) << 8u) | ((x & 0xff00ff00u) >> 8u);
    x = ((x & 0x0f0f0f0fu) << 4u) | ((x & 0xf0f0f0f0u) >> 4u);
    x = ((x & 0x33333333u) << 2u) | ((x & 0xccccccccu) >> 2u);
    return ((x & 0x55555555u) << 1u) | ((x & 0xaaaaaaaau) >> 1u);
}

/* The state of a pixel's sample: random numbers follow from it; samplers use both members differently. */
typedef struct { natural seed, index; } Sampler;
