/* A stage: a kernel whose work-items serve LANES slots each. Where PART names it, it is a function that
 * serves the LANES slots from `at` on, for the loop of all stages in stage/loop.cl.
 *
 *     STAGE(name)(SLAB_ARGS, SCENE_ARGS STAGE_AT_ARG) { SLABS SCENE STAGE_AT ... } */
#include "bvh/hints.cl"

#ifdef PART
#define STAGE(name) void PART
#define STAGE_AT_ARG , uint at
#define STAGE_AT
#else
#define STAGE(name) kernel NO_VECTORIZE void name
#define STAGE_AT_ARG
#define STAGE_AT uint at = get_global_id(0) * LANES;
#endif
