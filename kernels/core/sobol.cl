/* Owen-scrambled points, four dimensions at a time: a (0,4)-sequence in base 4 whose two pairs are (0,2)-sequences in
 * base 2, as Sobol's first pair is (after Ahmed 2025, "SZ Sequences", TOG 44(6)). The sample's index is shuffled, all
 * coordinates scrambled by nested uniform hashes (Burley 2020, JCGT 9(4); Laine and Karras 2011, constants of Vegdahl),
 * each pixel and group of four by its own seed. `index` of a `Sampler` is that of the sample, bits reversed. */
/* Nested uniform scramble of a bit-reversed number: every bit depends on the bits below it. */
inline natural scramble_reversed(natural x, natural seed)
{
    x = (x ^ (x * 0x3d20adeau)) + seed;
    x *= (seed >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    return x ^ (x * 0x53a22864u);
}

/* Words of 16 digits of base 4, bit-reversed: a digit's lower bit is more significant. With digits as elements of
 * GF(4): `t` times w, times w^2 = w + 1; and both bits of each digit swapped. */
#define DIGITS_TIMES_W(t) ((((t) ^ ((t) >> 1u)) & 0x55555555u) | (((t) & 0x55555555u) << 1u))
#define DIGITS_TIMES_W2(t) ((((t) >> 1u) & 0x55555555u) | ((((t) ^ ((t) >> 1u)) & 0x55555555u) << 1u))
#define DIGITS_SWAPPED(t) ((((t) >> 1u) & 0x55555555u) | (((t) & 0x55555555u) << 1u))

/* Faure's matrix over GF(4), Pascal's triangle with powers of an element: ODD is times it, EVEN times its square. */
#define DIGITS_PASCAL(x, ODD, EVEN)     \
    x ^= ODD((x & 0xccccccccu) >> 2u);  \
    x ^= EVEN((x & 0xf0f0f0f0u) >> 4u); \
    x ^= ODD((x & 0xff00ff00u) >> 8u);  \
    x ^= EVEN((x & 0xffff0000u) >> 16u);

inline Sampler sampler_start(uint seed, natural pixel, natural sample)
{
    return (Sampler){hash_natural(pixel ^ (seed * 0x9e3779b9u)), reverse_bits(sample)};
}

/* Dimensions 2 n and 2 n + 1 are the pairs of a group of four. */
inline vec2 sampler_pair(Sampler s, natural dimension)
{
    natural key = hash_natural(s.seed + (dimension >> 1u) * 0x9e3779b9u), second = 0u - (dimension & 1u);
    natural i = reverse_bits(scramble_reversed(s.index, key)), z = DIGITS_SWAPPED(i), w = z, w2 = z;
    DIGITS_PASCAL(z, as_natural, as_natural)
    DIGITS_PASCAL(w, DIGITS_TIMES_W, DIGITS_TIMES_W2)
    DIGITS_PASCAL(w2, DIGITS_TIMES_W2, DIGITS_TIMES_W)
    natural b = (~second & z) | (second & w2), other = key * (0x85ebca6bu ^ (second & 0x2c1b3c6cu));
    i = scramble_reversed((~second & i) | (second & DIGITS_SWAPPED(w)), other + 1u);
    b = scramble_reversed(b ^ ((b >> 1u) & 0x55555555u), other * 0xc2b2ae35u + 3u);
    return (vec2){unit_interval(reverse_bits(i)), unit_interval(reverse_bits(b))};
}
