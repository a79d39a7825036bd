/* For kernels whose code is vectors already: `kernel NO_VECTORIZE void name(...)`.
 *
 * Intel's CPU runtime puts several work-items into one vector unless it is told not to, which makes
 * a traversal in float8 five times slower.
 */
#define NO_VECTORIZE
#ifdef __has_attribute
#if __has_attribute(intel_vec_len_hint)
#undef NO_VECTORIZE
#define NO_VECTORIZE __attribute__((intel_vec_len_hint(1)))
#endif
#endif
