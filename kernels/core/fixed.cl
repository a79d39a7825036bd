/* Sums of pixels are whole numbers of 96 bits in two's complement, in units of 2^-48. They do not depend on the order
 * of terms, so that a film does not depend on the division of its samples, and films add without rounding. */
typedef struct { natural low, middle, high; } Fixed;
typedef struct { natural x, y, z; } Natural3;

#define FIXED_LARGEST 0x1p44f /* of a term */

inline Fixed fixed_zero(void) { Fixed f = {(natural)(0u), (natural)(0u), (natural)(0u)}; return f; }

/* The carry of a sum of two words, with `term` as an addend: 1 if it exceeded 32 bits. */
inline natural fixed_carry(natural sum, natural term) { return sel_n(sum < term, (natural)(1u), (natural)(0u)); }

inline Fixed fixed_add(Fixed a, Fixed b)
{
    Fixed f;
    f.low = a.low + b.low;
    natural carry = fixed_carry(f.low, b.low), middle = a.middle + carry;
    f.middle = middle + b.middle;
    f.high = a.high + b.high + fixed_carry(middle, carry) + fixed_carry(f.middle, b.middle);
    return f;
}

/* v in units, truncated; |v| is at most FIXED_LARGEST. Every step but the last is exact. */
inline Fixed fixed_of(real v)
{
    real rest = fabs(v);
    natural high = to_natural(rest * 0x1p-16f);
    rest -= to_real(high) * 0x1p16f;
    natural middle = to_natural(rest * 0x1p16f);
    rest -= to_real(middle) * 0x1p-16f;
    natural low = to_natural(rest * 0x1p48f), negative = as_natural(as_integer(v) >> 31);
    Fixed f = {low ^ negative, middle ^ negative, high ^ negative}, one = fixed_zero();
    one.low = negative & 1u;
    return fixed_add(f, one);
}

/* The same for 0 <= v < 2^16, without the highest word. */
inline Fixed fixed_of_small(real v)
{
    natural middle = to_natural(v * 0x1p16f), low = to_natural((v - to_real(middle) * 0x1p-16f) * 0x1p48f);
    return (Fixed){low, middle, (natural)(0u)};
}

/* Whether this function accepts all three values; false for values that are not finite. */
inline mask fixed_takes_small(vec3 v)
{
    return (v.x >= 0.0f) & (v.y >= 0.0f) & (v.z >= 0.0f) & (v.x + v.y + v.z < 65536.0f);
}

/* Whether another term might exceed a sum's 96 bits. */
inline mask fixed_is_full(natural high) { return high + 0x40000000u >= 0x80000000u; }

/* Sums in memory: three streams of words each, the lowest first. Several slots, and several devices, may add to a sum:
 * 32-bit atomics that carry, which OpenCL 1.2 has. */
/* Adds `v` to the word and returns the carry. */
inline uint sums_add_word(global uint *word, uint v)
{
    return v && atomic_add((volatile global uint *)word, v) > 0xffffffffu - v;
}

/* Adds a lane's number to the sum at `sum`; returns 1 if the sum is full then, else 0. stride: of the streams. */
inline uint sums_add(global uint *sum, size_t stride, uint low, uint middle, uint high)
{
    uint carry = sums_add_word(sum, low), next = middle + carry;
    high += (next < carry) + sums_add_word(sum + stride, next);
    if (!high) return 0;
    uint before = atomic_add((volatile global uint *)(sum + 2 * stride), high);
    return before + high + 0x40000000u >= 0x80000000u;
}

/* A sum as the nearest float. */
inline float sums_float(uint low, uint middle, uint high)
{
    uint negative = 0u - (high >> 31);
    ulong top = ((ulong)(high ^ negative) << 32) | (middle ^ negative);
    low = (low ^ negative) - negative; /* the carry of the two's complement goes on where low becomes 0 */
    top += negative && !low;
    int zeros = (int)clz(top | 1ul);   /* moving all bits up by these, 64 bits say all but for rounding */
    ulong bits = (top << zeros) | (zeros <= 32 ? (ulong)low >> (32 - zeros) : (ulong)low << (zeros - 32));
    bits |= zeros < 32 && (low << zeros); /* what was cut off decides a tie */
    float size = ldexp(convert_float(bits), -16 - zeros);
    return negative ? -size : size;
}
