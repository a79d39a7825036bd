/* Hints for compilers. */

/* FETCH(address): asks for a line of memory that is wanted soon. Nothing where a compiler has no built-in for it, under
 * Oclgrind (NOT_INLINED), which cannot interpret it, and on NVIDIA, whose built-in takes no pointer of OpenCL C 1.2. */
#define FETCH(address)
#if defined(__has_builtin) && !defined(NOT_INLINED) && !defined(cl_nv_pragma_unroll)
#if __has_builtin(__builtin_prefetch)
#undef FETCH
#define FETCH(address) __builtin_prefetch((const void *)(ulong)(address))
#endif
#endif

/* Step. */
/* For kernels with explicit vectors: `kernel NO_VECTORIZE void name(...)`.
 *
 * By default Intel's CPU runtime puts several work-items into a vector, which makes a traversal in float8 five
 * times slower.
 */
#define NO_VECTORIZE
#ifdef __has_attribute
#if __has_attribute(intel_vec_len_hint)
#undef NO_VECTORIZE
#define NO_VECTORIZE __attribute__((intel_vec_len_hint(1)))
#endif
#endif

/* Step few_registers: for GPU programs that fit FEW_REGISTERS registers: on AMD the number limits the groups in
 * flight. By default its compiler takes up to 156 for 92, and 172 for 154. */
#ifdef __GFX11__
#define NO_VECTORIZE __attribute__((amdgpu_waves_per_eu(1536 / FEW_REGISTERS)))
#elif defined(__GFX10__)
#define NO_VECTORIZE __attribute__((amdgpu_waves_per_eu(1024 / FEW_REGISTERS)))
#else
#define NO_VECTORIZE
#endif
