/* A single Owen-scrambled Sobol sequence for the whole film, dealt out along the Z curve (Ahmed and Wonka 2020,
 * "Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of Pixels"): the
 * samples of a pixel are a well-spread part of it, those of each square of pixels too, so that neighbours err
 * in opposite directions. The order of squares, and of the samples in a pixel, is shuffled by the nested
 * scrambling of the index, anew in every dimension. */
#include "core/sobol.cl"

/* pixel: along the Z curve; a pixel takes 2^bits neighbouring points, then as many of another sequence. */
inline Sampler zsobol_start(uint seed, uint bits, natural pixel, natural sample)
{
    natural far = (pixel >> 1u) >> (31u - bits); /* what has no room in the index: another sequence */
    Sampler s;
    s.seed = hash_natural(hash_natural((sample >> bits) * 0x85ebca6bu + far) ^ (seed * 0x9e3779b9u));
    s.index = reverse_bits((pixel << bits) | (sample & ((1u << bits) - 1u)));
    return s;
}
