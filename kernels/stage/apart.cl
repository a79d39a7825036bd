/* What a part of a loop gives to the others: a function that is called, so that it is compiled once. */
#define APART(type, name) __attribute__((noinline)) type name
