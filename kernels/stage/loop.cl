/* The bounce loop on the device: every work-item takes `share` neighbouring slots through all stages, again and again
 * until they are at the end of their work lists, or `bounces` times. On a CPU it is a core's own small wavefront: its
 * paths stay in the core's cache, and are sorted by material before they are shaded. The host need not wait for a count
 * of what is left, so it can enqueue a whole exposure at once; `restart` begins the lists. `which` says what kind of
 * paths is traced, where a scene has paths from lights (0) and from the camera (1). The host raises `leave` while the
 * loop runs, if the paths are of no use any more; a null pointer is never raised. The stages are those of the other
 * files here, each compiled by itself as a function (stage/stage.cl), in its own number of lanes, and linked.
 */
#include "core/base.cl"
#include "stage/stage.cl"
#include "stage/bounce.cl"

kernel NO_VECTORIZE void loop(SLAB_ARGS, SCENE_ARGS, LOOP_ARGS, global uint *queue, uint share, uint bounces,
                              uint restart, uint which, global const volatile uint *leave)
{
    SLABS
    uint first = get_global_id(0) * share, end = min(first + share, (uint)settings->slots);
    if (restart) {
        for (uint at = first; at < end; at += LANES) store_path_state(path, at, mask_of(1), (integer)(PATH_FRESH));
    }
    for (uint bounce = 0; bounce < bounces && !(leave && *leave); bounce++) {
        int left = 0;
        for (uint at = first; at < end; at += LANES) {
            bounce_begin(at, at + LANES);
            left |= any((load_path_state(path, at) & PATH_DONE) == 0);
        }
        if (!left) break;
        bounce_paths(SLAB_PASSED, SCENE_PASSED, LOOP_PASSED, which, queue, first, end);
    }
}
