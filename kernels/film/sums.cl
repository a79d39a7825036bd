/* Sums in memory: three streams of words each, the lowest first. Several slots, and several devices, may add to one
 * sum: 32-bit atomics that carry, which OpenCL 1.2 has. */

/* Adds `v` to the word and returns the carry. */
inline uint sums_add_word(global uint *word, uint v)
{
    return v && atomic_add((volatile global uint *)word, v) > 0xffffffffu - v;
}

/* Adds a lane's number to the sum at `sum`; returns 1 where that is full then, else 0. stride: of the streams. */
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
    int zeros = (int)clz(top | 1ul);   /* bits by which all are moved up, so that 64 bits say all but for rounding */
    ulong bits = (top << zeros) | (zeros <= 32 ? (ulong)low >> (32 - zeros) : (ulong)low << (zeros - 32));
    bits |= zeros < 32 && (low << zeros); /* what was cut off decides a tie */
    float size = ldexp(convert_float(bits), -16 - zeros);
    return negative ? -size : size;
}
