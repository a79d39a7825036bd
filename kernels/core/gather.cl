/* Memory lane by lane: `gather` reads table[at]; the index of an idle lane must be valid: give 0. `scatter_if`
 * writes only where m; if lanes write to the same address, the last lane counts.
 *
 * Processors with an instruction for it get it by a compiler's built-in function. Written out lane by lane, reads are
 * nine tenths of a compiled shading kernel, and of the time to compile it. LANE_BITS: a mask as a bit for each lane. */
#ifdef __has_builtin
#if LANES == 16 && defined(__AVX512F__) && __has_builtin(__builtin_ia32_gathersiv16sf)
#define NATIVE_GATHER(p, at) \
    __builtin_ia32_gathersiv16sf((real)(0.0f), (const void *)(size_t)(p), at, (ushort)0xffff, 4)
#define NATIVE_PAIRS(p, at) \
    as_float16(__builtin_ia32_gathersiv8di((long8)(0), (const void *)(size_t)(p), at, (uchar)0xff, 4))
#elif LANES == 8 && defined(__AVX2__) && __has_builtin(__builtin_ia32_gatherd_ps256)
#define LANE_BITS(m) __builtin_ia32_movmskps256(as_real(m))
#define NATIVE_GATHER(p, at) \
    __builtin_ia32_gatherd_ps256((real)(0.0f), (const float *)(size_t)(p), at, as_real((mask)(-1)), 4)
#define NATIVE_PAIRS(p, at) \
    as_float8(__builtin_ia32_gatherd_q256((long4)(0), (const long *)(size_t)(p), at, (long4)(-1), 4))
#endif
#if LANES == 16 && defined(__AVX512DQ__) && __has_builtin(__builtin_ia32_scattersiv16sf)
#define LANE_BITS(m) __builtin_ia32_cvtd2mask512(m)
#define NATIVE_SCATTER(p, at, m, v) \
    __builtin_ia32_scattersiv16sf((void *)(size_t)(p), LANE_BITS(m), at, v, 4)
#elif LANES == 8 && defined(__AVX512DQ__) && defined(__AVX512VL__) && __has_builtin(__builtin_ia32_scattersiv8sf)
#define NATIVE_SCATTER(p, at, m, v) \
    __builtin_ia32_scattersiv8sf((void *)(size_t)(p), __builtin_ia32_cvtd2mask256(m), at, v, 4)
#endif
#endif

#ifdef NATIVE_GATHER
#define READ(TYPE) TYPE r = as_##TYPE(NATIVE_GATHER(p, at));
#elif LANES == 1
#define READ(TYPE) TYPE r = p[at];
#else
#define READ_LANE(i) r.s##i = p[at.s##i];
#define READ(TYPE) TYPE r; FOR_LANES(READ_LANE)
#endif
inline real gather(global const float *p, integer at) { READ(real) return r; }
inline integer gather_i(global const uint *p, integer at) { READ(natural) return as_integer(r); }
inline integer gather_constant(constant uint *p, integer at) { READ(natural) return as_integer(r); }

#ifdef NATIVE_SCATTER
inline void scatter_if(global float *p, integer at, mask m, real v) { NATIVE_SCATTER(p, at, m, v); }
#elif LANES == 1
inline void scatter_if(global float *p, integer at, mask m, real v) { if (m) p[at] = v; }
#else
inline void scatter_if(global float *p, integer at, mask m, real v)
{
#define STORE(i) if (m.s##i) p[at.s##i] = v.s##i;
    FOR_LANES(STORE)
#undef STORE
}
#endif
