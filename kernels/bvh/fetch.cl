/* FETCH(address): the line of memory there is wanted soon. Nothing where a compiler has no word for it, and
 * under Oclgrind (NOT_INLINED), which cannot interpret it. */
#define FETCH(address)
#if defined(__has_builtin) && !defined(NOT_INLINED)
#if __has_builtin(__builtin_prefetch)
#undef FETCH
#define FETCH(address) __builtin_prefetch((const void *)(ulong)(address))
#endif
#endif
