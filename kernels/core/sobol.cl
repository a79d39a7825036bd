/* Owen-scrambled points, four dimensions at a time: a (0,4)-sequence in base 4 whose two pairs are (0,2)-sequences in
 * base 2, as Sobol's first two dimensions are (after Ahmed 2025, "SZ Sequences", ACM TOG 44(6): matrices over GF(4) in
 * place of its search for them). The sample's index is shuffled and all coordinates scrambled by nested uniform hashes
 * (Burley 2020, JCGT 9(4); Laine and Karras 2011 with the constants of Vegdahl). Groups of four and pixels are
 * decorrelated by their seeds. `index` of a `Sampler` is that of the sample, bits reversed. */
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

/* Words of 16 digits of base 4, bit-reversed: of a digit the lower bit is the more significant one. As elements of
 * GF(4), `t` of these times w and its square, where w^2 = w + 1; and both bits of each digit swapped. */
#define DIGITS_LOW 0x55555555u
#define DIGITS_ALIKE(t) (t)
#define DIGITS_TIMES_W(t) ((((t) ^ ((t) >> 1u)) & DIGITS_LOW) | (((t) & DIGITS_LOW) << 1u))
#define DIGITS_TIMES_W2(t) ((((t) >> 1u) & DIGITS_LOW) | ((((t) ^ ((t) >> 1u)) & DIGITS_LOW) << 1u))
#define DIGITS_SWAPPED(t) ((((t) >> 1u) & DIGITS_LOW) | (((t) & DIGITS_LOW) << 1u))

/* Faure's matrix over GF(4), Pascal's triangle with powers of an element a: a step for each bit of a digit's place,
 * which multiplies by a to the power of 1, 2, 4 and 8; ODD is times a and a^4, EVEN times a^2 and a^8. */
#define DIGITS_PASCAL(x, ODD, EVEN)          \
    {                                        \
        natural t = (x & 0xccccccccu) >> 2u; \
        x ^= ODD(t);                         \
        t = (x & 0xf0f0f0f0u) >> 4u;         \
        x ^= EVEN(t);                        \
        t = (x & 0xff00ff00u) >> 8u;         \
        x ^= ODD(t);                         \
        t = (x & 0xffff0000u) >> 16u;        \
        x ^= EVEN(t);                        \
    }

inline Sampler sampler_start(uint seed, natural pixel, natural sample)
{
    Sampler s;
    s.seed = hash_natural(pixel ^ (seed * 0x9e3779b9u));
    s.index = reverse_bits(sample);
    return s;
}

/* Dimensions 2 n and 2 n + 1 are the pairs of a group of four. */
inline vec2 sampler_pair(Sampler s, natural dimension)
{
    natural key = hash_natural(s.seed + (dimension >> 1u) * 0x9e3779b9u), second = 0u - (dimension & 1u);
    natural i = reverse_bits(scramble_reversed(s.index, key));
    natural y = DIGITS_SWAPPED(i), z = y, w = y, w2 = y;
    DIGITS_PASCAL(z, DIGITS_ALIKE, DIGITS_ALIKE)
    DIGITS_PASCAL(w, DIGITS_TIMES_W, DIGITS_TIMES_W2)
    DIGITS_PASCAL(w2, DIGITS_TIMES_W2, DIGITS_TIMES_W)
    natural a = (~second & i) | (second & DIGITS_SWAPPED(w)), b = (~second & z) | (second & w2);
    b ^= (b >> 1u) & DIGITS_LOW;
    natural other = key * (0x85ebca6bu ^ (second & 0x2c1b3c6cu));
    vec2 u = {unit_interval(reverse_bits(scramble_reversed(a, other + 1u))),
              unit_interval(reverse_bits(scramble_reversed(b, other * 0xc2b2ae35u + 3u)))};
    return u;
}
