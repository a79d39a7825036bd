/* What parameters look up in textures, as a part of the loop (stage/loop.cl) that is compiled once for all others:
 * clpt/render/textures/cases.py. */
#include "core/base.cl"
#include "stage/apart.cl"
#include "generated/textures.cl"
