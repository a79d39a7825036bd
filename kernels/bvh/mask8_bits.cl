/* Eight truth values as eight bits, where vectors are taken apart: see bvh/mask8.cl. */
typedef uint Mask8;
inline Mask8 mask8(int8 m)
{
    int8 bits = m & (int8)(1, 2, 4, 8, 16, 32, 64, 128);
    int4 four = bits.lo | bits.hi;
    return (uint)(four.x | four.y | four.z | four.w);
}
inline uint mask8_first(Mask8 m) { return 31 - clz(m & -m); }
inline uint mask8_last(Mask8 m) { return 31 - clz(m); }
