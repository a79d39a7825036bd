/* The built-in functions of OpenCL C that clpt's texts call, in place of a compiler's header of 18,000
 * lines: see clpt/device/building.py. Source: The OpenCL C Specification 1.2, 6.12.
 * Types and constants come from the compiler. */
#define PURE __attribute__((overloadable, const))
#define CALLED __attribute__((overloadable))
#define FLOATS(F, name) F(name, float) F(name, float2) F(name, float3) F(name, float4) F(name, float8) F(name, float16)
#define WIDTHS(F, name, T) F(name, T) F(name, T##2) F(name, T##3) F(name, T##4) F(name, T##8) F(name, T##16)
#define WHOLES(F, name) WIDTHS(F, name, int) WIDTHS(F, name, uint) WIDTHS(F, name, long) WIDTHS(F, name, ulong)
#define BESIDE(F, name, T, U) \
    F(name, T, U) F(name, T##2, U##2) F(name, T##3, U##3) F(name, T##4, U##4) F(name, T##8, U##8) F(name, T##16, U##16)
#define SCALED(F, name, T) F(name, T, T##2) F(name, T, T##3) F(name, T, T##4) F(name, T, T##8) F(name, T, T##16)

#define ONE(name, T) T PURE name(T);
#define TWO(name, T) T PURE name(T, T);
#define THREE(name, T) T PURE name(T, T, T);
FLOATS(ONE, acos) FLOATS(ONE, asin) FLOATS(ONE, asinh) FLOATS(ONE, atan) FLOATS(ONE, cbrt) FLOATS(ONE, ceil)
FLOATS(ONE, cos) FLOATS(ONE, cosh) FLOATS(ONE, degrees) FLOATS(ONE, erf) FLOATS(ONE, erfc) FLOATS(ONE, exp)
FLOATS(ONE, exp2) FLOATS(ONE, exp10) FLOATS(ONE, expm1) FLOATS(ONE, fabs) FLOATS(ONE, floor) FLOATS(ONE, lgamma)
FLOATS(ONE, log) FLOATS(ONE, log2) FLOATS(ONE, log10) FLOATS(ONE, log1p) FLOATS(ONE, native_cos)
FLOATS(ONE, native_exp) FLOATS(ONE, native_log) FLOATS(ONE, native_recip)
FLOATS(ONE, native_rsqrt) FLOATS(ONE, native_sin) FLOATS(ONE, native_sqrt) FLOATS(ONE, radians) FLOATS(ONE, rint)
FLOATS(ONE, round) FLOATS(ONE, rsqrt) FLOATS(ONE, sign) FLOATS(ONE, sin) FLOATS(ONE, sinh) FLOATS(ONE, sqrt)
FLOATS(ONE, tan) FLOATS(ONE, tanh) FLOATS(ONE, tgamma) FLOATS(ONE, trunc)
FLOATS(TWO, atan2) FLOATS(TWO, copysign) FLOATS(TWO, fmax) FLOATS(TWO, fmin) FLOATS(TWO, fmod) FLOATS(TWO, hypot)
FLOATS(TWO, max) FLOATS(TWO, min) FLOATS(TWO, native_divide) FLOATS(TWO, nextafter) FLOATS(TWO, pow)
FLOATS(TWO, powr) FLOATS(TWO, remainder) FLOATS(TWO, step)
FLOATS(THREE, clamp) FLOATS(THREE, fma) FLOATS(THREE, mad) FLOATS(THREE, mix) FLOATS(THREE, smoothstep)
WHOLES(ONE, clz) WHOLES(ONE, popcount) WHOLES(TWO, max) WHOLES(TWO, min) WHOLES(TWO, mul_hi) WHOLES(TWO, rotate)
WHOLES(THREE, clamp)

#define LIMIT_BY(name, S, T) T PURE name(T, S);
#define WITHIN(name, S, T) T PURE name(T, S, S);
#define LIMIT(S) SCALED(LIMIT_BY, max, S) SCALED(LIMIT_BY, min, S) SCALED(WITHIN, clamp, S)
LIMIT(float) LIMIT(int) LIMIT(uint)
SCALED(LIMIT_BY, fmax, float) SCALED(LIMIT_BY, fmin, float)
#define MIX_BY(name, S, T) T PURE name(T, T, S);
#define STEP_AT(name, S, T) T PURE name(S, T);
SCALED(MIX_BY, mix, float) SCALED(STEP_AT, step, float)

#define TOLD(name, T, U) U PURE name(T);
#define TURNED(name, T, U) T PURE name(T, U);
#define CHOSEN(name, T, U) T PURE name(T, T, U);
BESIDE(TOLD, isfinite, float, int) BESIDE(TOLD, isinf, float, int) BESIDE(TOLD, isnan, float, int)
BESIDE(TOLD, signbit, float, int) BESIDE(TOLD, abs, int, uint) BESIDE(TOLD, abs, uint, uint)
BESIDE(TOLD, abs, long, ulong) BESIDE(TURNED, ldexp, float, int) BESIDE(TURNED, pown, float, int)
BESIDE(CHOSEN, select, float, int) BESIDE(CHOSEN, select, float, uint) BESIDE(CHOSEN, select, int, int)
BESIDE(CHOSEN, select, int, uint) BESIDE(CHOSEN, select, uint, int) BESIDE(CHOSEN, select, uint, uint)
BESIDE(CHOSEN, select, long, long) BESIDE(CHOSEN, select, ulong, ulong) BESIDE(CHOSEN, select, ulong, long)
#define ASKED(name, T) int PURE name(T);
WIDTHS(ASKED, any, char) WIDTHS(ASKED, any, int) WIDTHS(ASKED, any, long)
WIDTHS(ASKED, all, char) WIDTHS(ASKED, all, int) WIDTHS(ASKED, all, long)
float CALLED frexp(float, private int *);
float CALLED modf(float, private float *);

#define SMALL(F, name) F(name, float) F(name, float2) F(name, float3) F(name, float4)
#define MEASURED(name, T) float PURE name(T);
#define ACROSS(name, T) float PURE name(T, T);
SMALL(MEASURED, length) SMALL(ONE, normalize) SMALL(ACROSS, dot) SMALL(ACROSS, distance)
float3 PURE cross(float3, float3);
float4 PURE cross(float4, float4);

#define FROM(form, T, n, ending, S) T##n PURE convert_##form##n##ending(S##n);
#define FROM_EACH(form, T, n, ending)                                                              \
    FROM(form, T, n, ending, char) FROM(form, T, n, ending, uchar) FROM(form, T, n, ending, short) \
    FROM(form, T, n, ending, ushort) FROM(form, T, n, ending, int) FROM(form, T, n, ending, uint)  \
    FROM(form, T, n, ending, long) FROM(form, T, n, ending, ulong) FROM(form, T, n, ending, float)
#define CONVERT(T, ending)                                                                                     \
    FROM_EACH(T, T, , ending) FROM_EACH(T, T, 2, ending) FROM_EACH(T, T, 3, ending) FROM_EACH(T, T, 4, ending) \
    FROM_EACH(T, T, 8, ending) FROM_EACH(T, T, 16, ending)
CONVERT(char, ) CONVERT(uchar, ) CONVERT(ushort, ) CONVERT(int, ) CONVERT(uint, ) CONVERT(long, ) CONVERT(ulong, )
CONVERT(float, ) CONVERT(uchar, _sat) CONVERT(int, _sat) CONVERT(uint, _sat) CONVERT(uint, _sat_rte)
CONVERT(int, _rte) CONVERT(int, _rtn) CONVERT(long, _sat)

#define LOADED(T, n, space) T##n __attribute__((overloadable, pure)) vload##n(size_t, const space T *);
#define STORED(T, n, space) void CALLED vstore##n(T##n, size_t, space T *);
#define MOVED(T, n)                                                                       \
    LOADED(T, n, constant) LOADED(T, n, global) LOADED(T, n, local) LOADED(T, n, private) \
    STORED(T, n, global) STORED(T, n, local) STORED(T, n, private)
#define MOVES(T) MOVED(T, 2) MOVED(T, 3) MOVED(T, 4) MOVED(T, 8) MOVED(T, 16)
MOVES(float) MOVES(int) MOVES(uint) MOVES(uchar) MOVES(ushort) MOVES(ulong)

#define COUNTED(T, space)                                                                       \
    T CALLED atomic_add(volatile space T *, T); T CALLED atomic_sub(volatile space T *, T);     \
    T CALLED atomic_xchg(volatile space T *, T); T CALLED atomic_inc(volatile space T *);       \
    T CALLED atomic_dec(volatile space T *); T CALLED atomic_cmpxchg(volatile space T *, T, T); \
    T CALLED atomic_min(volatile space T *, T); T CALLED atomic_max(volatile space T *, T);     \
    T CALLED atomic_and(volatile space T *, T); T CALLED atomic_or(volatile space T *, T);
COUNTED(int, global) COUNTED(uint, global) COUNTED(int, local) COUNTED(uint, local)
void __attribute__((overloadable, convergent)) barrier(cl_mem_fence_flags);
void CALLED mem_fence(cl_mem_fence_flags);
uint PURE get_work_dim(void);
#define PLACED(name) size_t PURE name(uint);
PLACED(get_global_size) PLACED(get_global_id) PLACED(get_local_size) PLACED(get_local_id) PLACED(get_num_groups)
PLACED(get_group_id) PLACED(get_global_offset)
void CALLED write_imagef(write_only image2d_t, int2, float4);
