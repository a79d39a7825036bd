/* A stage: a kernel whose work-items serve LANES slots each. Where PART names it, it is a function that
 * serves the LANES slots from `at` on, for the loop of all stages in stage/loop.cl. Where QUEUED, a work-item serves
 * a slot of queue 0; where the queue is null, its own.
 *
 *     STAGE(name)(SLAB_ARGS, SCENE_ARGS STAGE_AT_ARG) { STAGE_BEGIN ... } */
#include "bvh/hints.cl"
#include "core/base.cl"

#ifdef PART
#define STAGE(name) void PART
#define STAGE_AT_ARG , uint at
#define STAGE_AT
#elif QUEUED
#define STAGE(name) kernel NO_VECTORIZE void name
#define STAGE_AT_ARG , global const uint *queue, global const uint *queue_counts
#define STAGE_AT                                         \
    uint at = get_global_id(0);                          \
    if (queue && at >= queue_counts[0]) return;          \
    if (queue) at = queue[at];
#else
#define STAGE(name) kernel NO_VECTORIZE void name
#define STAGE_AT_ARG
#define STAGE_AT uint at = get_global_id(0) * LANES;
#endif
#define STAGE_BEGIN SLABS SCENE STAGE_AT

/* A function that other parts of a loop call, so that it is compiled once. */
#define APART(type, name) __attribute__((noinline)) type name
