/* Look-ups of textures for parameters, as a part of the loop (stage/loop.cl) that is compiled once for all others:
 * clpt/render/textures/cases.py. */
#include "core/base.cl"
#define APART(type, name) __attribute__((noinline)) type name /* called by other parts, so it is compiled once */
#include "generated/textures.cl"
