/* The bounce loop on the device: every work-item takes LANES slots through all stages, again and again until they are
 * at the end of their work lists, or `bounces` times. The host need not wait for a count of what is left, so it can
 * enqueue a whole exposure at once; `restart` begins the lists. The stages are those of the other files here, each
 * compiled by itself as a function (interface/stage.cl), in its own number of lanes, and linked. */
#include "core/base.cl"
#include "interface/stage.cl"
#include "generated/trace_args.cl"
#include "generated/loop.cl"

kernel NO_VECTORIZE void loop(SLAB_ARGS, SCENE_ARGS, TRACE_ARGS, BEGIN_ARGS, uint bounces, uint restart)
{
    SLABS
    uint at = get_global_id(0) * LANES;
    if (restart) store_path_state(path, at, mask_of(1), (integer)(PATH_FRESH));
    for (uint bounce = 0; bounce < bounces; bounce++) {
        loop_begin(SLAB_PASSED, SCENE_PASSED, BEGIN_PASSED, at);
        if (!any((load_path_state(path, at) & PATH_DONE) == 0)) break;
        loop_bounce(SLAB_PASSED, SCENE_PASSED, TRACE_PASSED, BEGIN_PASSED, at);
    }
}
