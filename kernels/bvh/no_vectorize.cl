/* For kernels whose code is vectors already: `kernel NO_VECTORIZE void name(...)`.
 *
 * Intel's CPU runtime puts several work-items into one vector unless it is told not to, which makes
 * a traversal in float8 five times slower. AMD's GPUs, where FEW_REGISTERS is set, let as many groups run as 128
 * registers a work-item allow: left alone their compiler takes up to 156 for what needs fewer.
 */
#define NO_VECTORIZE
#ifdef __has_attribute
#if __has_attribute(intel_vec_len_hint)
#undef NO_VECTORIZE
#define NO_VECTORIZE __attribute__((intel_vec_len_hint(1)))
#endif
#endif
#if FEW_REGISTERS
#if defined(__GFX11__)
#undef NO_VECTORIZE
#define NO_VECTORIZE __attribute__((amdgpu_waves_per_eu(12)))
#elif defined(__GFX10__)
#undef NO_VECTORIZE
#define NO_VECTORIZE __attribute__((amdgpu_waves_per_eu(8)))
#endif
#endif
