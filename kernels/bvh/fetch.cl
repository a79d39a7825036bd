/* FETCH(address): the line of memory there is wanted soon. Nothing where a compiler has no word for it. */
#define FETCH(address)
#ifdef __has_builtin
#if __has_builtin(__builtin_prefetch)
#undef FETCH
#define FETCH(address) __builtin_prefetch((const void *)(ulong)(address))
#endif
#endif
