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
