/* Consecutive words of a table, lane by lane: table[at], table[at + 1] and so on; an idle lane's index must be valid:
 * give 0. `gather2` to `gather4` read the words of a lane at once and transpose them in registers, half of
 * the time of reading word by word. gather_w4 is gather4 of a table of words.
 *
 * `row4` is gather_w4 for tables of few rows: lanes mostly read the same row, whose words are then broadcast.
 * Otherwise processors with gathers read pairs of words: slower than a transposition, but 10 instructions instead of
 * 100 at each of many uses. */
#if LANES == 1
inline vec2 gather2(global const float *p, integer at) { vec2 r = {p[at], p[at + 1]}; return r; }
inline vec3 gather3(global const float *p, integer at) { vec3 r = {p[at], p[at + 1], p[at + 2]}; return r; }
inline vec4 gather4(global const float *p, integer at) { vec4 r = {p[at], p[at + 1], p[at + 2], p[at + 3]}; return r; }
#else
typedef float2 Row2 __attribute__((aligned(4)));
typedef float4 Row4 __attribute__((aligned(4)));
#define ROW_2(i) (*(global const Row2 *)(p + at.s##i))
#define ROW_3(i) JOINED_4(*(global const Row2 *)(p + at.s##i), *(global const Row2 *)(p + at.s##i + 1))
#define ROW_4(i) (*(global const Row4 *)(p + at.s##i))
/* Two vectors joined, and every second word of both. With clang's function, which all CPU compilers have, each is a
 * single instruction. `.even` and a vector of vectors are three, vload4 is a call. */
#define JOINED_4(a, b) __builtin_shufflevector(a, b, 0, 1, 2, 3)
#define JOINED_8(a, b) __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7)
#define JOINED_16(a, b) __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)
#if LANES == 8
#define EVENS(a, b) __builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14)
#define ODDS(a, b) __builtin_shufflevector(a, b, 1, 3, 5, 7, 9, 11, 13, 15)
#else
#define EVENS(a, b) __builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30)
#define ODDS(a, b) __builtin_shufflevector(a, b, 1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31)
#endif
#define JOINED_4x2(R, i, j, k, l) JOINED_8(JOINED_4(R(i), R(j)), JOINED_4(R(k), R(l)))
#if LANES == 8
#define ROW_HALVES(R) real a = JOINED_4x2(R, 0, 1, 2, 3), b = JOINED_4x2(R, 4, 5, 6, 7);
#define ROW_QUARTERS(R) \
    real a = JOINED_8(R(0), R(1)), b = JOINED_8(R(2), R(3)), c = JOINED_8(R(4), R(5)), d = JOINED_8(R(6), R(7));
#else
#define JOINED_4x4(R, i, j, k, l) JOINED_16(JOINED_8(R(i), R(j)), JOINED_8(R(k), R(l)))
#define JOINED_8x2(R, i, j, k, l, m, n, o, q) JOINED_16(JOINED_4x2(R, i, j, k, l), JOINED_4x2(R, m, n, o, q))
#define ROW_HALVES(R) real a = JOINED_8x2(R, 0, 1, 2, 3, 4, 5, 6, 7), b = JOINED_8x2(R, 8, 9, a, b, c, d, e, f);
#define ROW_QUARTERS(R)                                                \
    real a = JOINED_4x4(R, 0, 1, 2, 3), b = JOINED_4x4(R, 4, 5, 6, 7); \
    real c = JOINED_4x4(R, 8, 9, a, b), d = JOINED_4x4(R, c, d, e, f);
#endif
inline vec2 gather2(global const float *p, integer at)
{
#ifdef NATIVE_PAIRS
    real a = NATIVE_PAIRS(p, at.lo), b = NATIVE_PAIRS(p, at.hi);
#else
    ROW_HALVES(ROW_2)
#endif
    return (vec2){EVENS(a, b), ODDS(a, b)};
}
inline vec3 gather3(global const float *p, integer at)
{
    ROW_QUARTERS(ROW_3)
    real xy = EVENS(a, b), last_xy = EVENS(c, d), yz = ODDS(a, b), last_yz = ODDS(c, d);
    return (vec3){EVENS(xy, last_xy), EVENS(yz, last_yz), ODDS(yz, last_yz)};
}
inline vec4 gather4(global const float *p, integer at)
{
    ROW_QUARTERS(ROW_4)
    real xz = EVENS(a, b), last_xz = EVENS(c, d), yw = ODDS(a, b), last_yw = ODDS(c, d);
    return (vec4){EVENS(xz, last_xz), EVENS(yw, last_yw), ODDS(xz, last_xz), ODDS(yw, last_yw)};
}
#undef ROW_2
#undef ROW_3
#undef ROW_4
#undef ROW_HALVES
#undef ROW_QUARTERS
#endif
inline vec4 gather_w4(global const uint *p, integer at) { return gather4((global const float *)p, at); }

#ifdef NATIVE_PAIRS
inline vec4 row4_alike(global const uint *table, integer at)
{
    global const float *row = (global const float *)table;
    if (any(at != at.s0)) {
        real a = NATIVE_PAIRS(row, at.lo), b = NATIVE_PAIRS(row, at.hi);
        real c = NATIVE_PAIRS(row + 2, at.lo), d = NATIVE_PAIRS(row + 2, at.hi);
        return (vec4){EVENS(a, b), ODDS(a, b), EVENS(c, d), ODDS(c, d)};
    }
    Row4 one = *(global const Row4 *)(row + at.s0);
    return (vec4){(real)(one.x), (real)(one.y), (real)(one.z), (real)(one.w)};
}
#define row4 row4_alike
#else
#define row4 gather_w4
#endif
