/* Lanes: the types that all shading code is written in.
 *
 * A GPU builds the text with LANES = 1, so that a work-item shades a path; a CPU with LANES = 8 or
 * 16, so that a work-item shades that many paths in SIMD. `real`, `integer` and `mask` are then
 * vectors. A kind's functions are branch-free except for `if (any(mask))`, which in a single lane is a plain
 * branch. Masks come from comparisons, combine with & and |, and negate with !, never with ~ (a
 * true scalar comparison is 1, a true vector comparison is -1).
 */
/* By default compilers call small functions and return their structs through memory, lane by lane: a third of the time
 * of shading. (Oclgrind cannot run the inlined code.) */
#ifndef NOT_INLINED
#define inline __attribute__((always_inline)) inline
#endif
/* Long functions with several call sites are `called`, so that a CPU's compiler emits them once. */
#if LANES > 1 && !defined(NOT_INLINED)
#define called __attribute__((noinline))
#else
#define called inline
#endif

/* For loops on GPUs. Registers cannot be indexed, so loops over small arrays are UNROLLED, which keeps the arrays out
 * of memory. Long loops that run seldom are ROLLED: instructions are fetched from memory too. */
#if LANES == 1 && !defined(NOT_INLINED)
#define UNROLLED _Pragma("unroll")
#define ROLLED _Pragma("unroll 1")
#else
#define UNROLLED
#define ROLLED
#endif

#define CAT_(a, b) a##b
#define CAT(a, b) CAT_(a, b)

#if LANES == 1
typedef float real;
typedef int integer;
typedef uint natural;
#define as_real as_float
#define as_integer as_int
#define as_natural as_uint
#define to_real(x) convert_float(x)
#define to_integer(x) convert_int(x)
#define to_natural(x) convert_uint(x)
#undef any
#define any(m) (m)
#define LANE_INDEX 0
inline uint lanes_of(int m) { return (uint)m; }
#else
typedef CAT(float, LANES) real;
typedef CAT(int, LANES) integer;
typedef CAT(uint, LANES) natural;
#define as_real CAT(as_float, LANES)
#define as_integer CAT(as_int, LANES)
#define as_natural CAT(as_uint, LANES)
#define to_real(x) CAT(convert_float, LANES)(x)
#define to_integer(x) CAT(convert_int, LANES)(x)
#define to_natural(x) CAT(convert_uint, LANES)(x)
#if LANES == 8
#define LANE_INDEX ((integer)(0, 1, 2, 3, 4, 5, 6, 7))
#else
#define LANE_INDEX ((integer)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15))
#endif
#endif
typedef integer mask;

typedef struct { real x, y; } vec2;
typedef struct { real x, y, z; } vec3;
typedef struct { real x, y, z, w; } vec4;

/* A scalar condition as a mask: 1 in a vector would select nothing. */
#if LANES == 1
#define mask_of(condition) (condition)
#else
#define mask_of(condition) ((mask)((condition) ? -1 : 0))
#endif

/* Choice: a where m, else b. */
inline real sel(mask m, real a, real b) { return m ? a : b; }
inline integer sel_i(mask m, integer a, integer b) { return m ? a : b; }
inline natural sel_n(mask m, natural a, natural b) { return m ? a : b; }
inline vec3 sel3(mask m, vec3 a, vec3 b) { vec3 r = {sel(m, a.x, b.x), sel(m, a.y, b.y), sel(m, a.z, b.z)}; return r; }

inline real min_r(real a, real b) { return a < b ? a : b; }
inline real max_r(real a, real b) { return a > b ? a : b; }
inline integer min_i(integer a, integer b) { return a < b ? a : b; }
inline integer max_i(integer a, integer b) { return a > b ? a : b; }
inline integer clamp_i(integer i, integer most) { return max_i(min_i(i, most), (integer)(0)); } /* an index */
inline real clamp_r(real x, real lo, real hi) { return min_r(max_r(x, lo), hi); }
inline real sqrt_r(real x) { return sqrt(max_r(x, (real)(0.0f))); } /* of a rounded negative: 0 */

#if LANES == 1
#define FOR_LANES(F) F(0)
#define LANE(v, i) (v)
#else
#define LANES_8(F) F(0) F(1) F(2) F(3) F(4) F(5) F(6) F(7)
#if LANES == 8
#define FOR_LANES(F) LANES_8(F)
#else
#define FOR_LANES(F) LANES_8(F) F(8) F(9) F(a) F(b) F(c) F(d) F(e) F(f)
#endif
#define LANE(v, i) ((v).s##i)
#endif
#include "core/gather.cl"

#if LANES == 1
inline int sum_lanes(integer v) { return v; }
#else
/* Compilers fold their built-in functions for a constant mask, and drop the branch; convert_char8 may be a library
 * function that is linked later. */
#ifdef LANE_BITS
inline int any_lane(mask m) { return LANE_BITS(m) != 0; }
#elif LANES == 8
inline int any_lane(mask m) { return as_ulong(__builtin_convertvector(m, char8)) != 0; }
#else
inline int any_lane(mask m) { ulong2 q = as_ulong2(__builtin_convertvector(m, char16)); return (q.x | q.y) != 0; }
#endif
#undef any
#define any(m) any_lane(m) /* OpenCL's own any() is slow on some runtimes */
inline int sum_lanes(integer v)
{
    int r = 0;
#define ADD(i) r += v.s##i;
    FOR_LANES(ADD)
#undef ADD
    return r;
}
inline uint lanes_of(mask m) { return (uint)-sum_lanes(m); }
#endif
/* A word read as a float, and an aligned block of LANES neighbours read or written at once. */
inline real gather_w(global const uint *p, integer at) { return as_real(gather_i(p, at)); }
#define block_load(p) (*(global const real *)(p))
#define block_store(p, v) (*(global real *)(p) = (v))
