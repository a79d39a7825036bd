/* Look-ups of textures for parameters, as a part of the loop (stage/loop.cl) that is compiled once for all others:
 * clpt/render/textures/cases.py. */
#include "stage/stage.cl"
#include "generated/textures.cl"
