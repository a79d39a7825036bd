/* Eight truth values as bits, and the first and last true value.
 *
 * On x86 an instruction returns the sign bits of a vector; elsewhere eight bytes of a ulong hold them.
 */

/* Step. */
#if defined(__AVX__) && defined(__has_builtin)
#if __has_builtin(__builtin_ia32_movmskps256) && __has_builtin(__builtin_ctz)
#define MASK8_NATIVE
#endif
#endif

#ifdef MASK8_NATIVE
typedef uint Mask8;
inline Mask8 mask8(int8 m) { return (uint)__builtin_ia32_movmskps256(as_float8(m)); }
inline uint mask8_first(Mask8 m) { return (uint)__builtin_ctz(m); }
inline uint mask8_last(Mask8 m) { return 31 - clz(m); }
inline Mask8 mask8_without(Mask8 m, uint i) { return m ^ 1u << i; }
#else
typedef ulong Mask8;
inline Mask8 mask8(int8 m) { return as_ulong(convert_char8(m)) & 0x0101010101010101ul; }
inline uint mask8_first(Mask8 m) { return (uint)(63 - clz(m & -m)) >> 3; }
inline uint mask8_last(Mask8 m) { return (uint)(63 - clz(m)) >> 3; }
inline Mask8 mask8_without(Mask8 m, uint i) { return m ^ 1ul << 8 * i; }
#endif

/* Step bits: eight bits, for devices without vectors. */
typedef uint Mask8;
inline Mask8 mask8(int8 m)
{
    int8 bits = m & (int8)(1, 2, 4, 8, 16, 32, 64, 128);
    int4 four = bits.lo | bits.hi;
    return (uint)(four.x | four.y | four.z | four.w);
}
inline uint mask8_first(Mask8 m) { return 31 - clz(m & -m); }
inline uint mask8_last(Mask8 m) { return 31 - clz(m); }
