/* FETCH(address): asks for a line of memory that is wanted soon. Nothing where a compiler has no built-in for it, and
 * under Oclgrind (NOT_INLINED), which cannot interpret it. */
#define FETCH(address)
#if defined(__has_builtin) && !defined(NOT_INLINED)
#if __has_builtin(__builtin_prefetch)
#undef FETCH
#define FETCH(address) __builtin_prefetch((const void *)(ulong)(address))
#endif
#endif
