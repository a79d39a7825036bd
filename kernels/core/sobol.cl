/* Owen-scrambled Sobol points, two dimensions at a time: the sample's index is shuffled and both
 * coordinates scrambled by nested uniform hashes (Burley 2020, JCGT 9(4); Laine and Karras 2011 with
 * the constants of Vegdahl). Dimension pairs and pixels are decorrelated by their seeds. `index` of a
 * `Sampler` is that of the sample, bits reversed. */
/* Nested uniform scramble of a bit-reversed number: every bit depends on the bits below it. */
inline natural scramble_reversed(natural x, natural seed)
{
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

/* Sobol's second dimension of a bit-reversed index, bit-reversed: Pascal's triangle modulo 2. */
inline natural sobol_second_reversed(natural x)
{
    x ^= (x & 0xaaaaaaaau) >> 1u;
    x ^= (x & 0xccccccccu) >> 2u;
    x ^= (x & 0xf0f0f0f0u) >> 4u;
    x ^= (x & 0xff00ff00u) >> 8u;
    x ^= (x & 0xffff0000u) >> 16u;
    return x;
}

inline Sampler sampler_start(uint seed, natural pixel, natural sample)
{
    Sampler s;
    s.seed = hash_natural(pixel ^ (seed * 0x9e3779b9u));
    s.index = reverse_bits(sample);
    return s;
}

inline vec2 sampler_pair(Sampler s, natural dimension)
{
    natural key = hash_natural(s.seed + dimension * 0x9e3779b9u);
    natural x = scramble_reversed(s.index, key); /* the shuffled index is the first coordinate */
    natural i = reverse_bits(x);
    vec2 u = {unit_interval(reverse_bits(scramble_reversed(i, key * 0x85ebca6bu + 1u))),
              unit_interval(reverse_bits(scramble_reversed(sobol_second_reversed(i), key * 0xc2b2ae35u + 3u)))};
    return u;
}
