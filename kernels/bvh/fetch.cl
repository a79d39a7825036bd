/* FETCH(address): asks for a line of memory that is wanted soon. Nothing where a compiler has no built-in for it, under
 * Oclgrind (NOT_INLINED), which cannot interpret it, and on NVIDIA, whose built-in takes no pointer of OpenCL C 1.2. */
#define FETCH(address)
#if defined(__has_builtin) && !defined(NOT_INLINED) && !defined(cl_nv_pragma_unroll)
#if __has_builtin(__builtin_prefetch)
#undef FETCH
#define FETCH(address) __builtin_prefetch((const void *)(ulong)(address))
#endif
#endif
