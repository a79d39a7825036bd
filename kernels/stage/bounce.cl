/* A bounce of the paths of a work-item of stage/loop.cl: the slots from `first` to `end` go through all stages but the
 * one that begins paths. Each verb `bounce_...` takes slots through one stage, whatever that is for the kind of paths
 * that is traced, and does nothing where no path has that stage: they are made for a scene. Before they are shaded, the
 * slots are sorted by material, so that a block of LANES slots has one kind; where nearly all wait for one kind they
 * are shaded as they lie. */
#include "generated/loop_args.cl"
#include "transport/queue.cl"
#include "generated/bounce_stages.cl"

#define BLOCK (settings->slots + get_global_id(0) * LANES) /* the first slot of the work-item's block */
#define bounce_shade(kind, first, end)                 \
    for (uint slot = first; slot < end; slot += LANES) \
        bounce_shade_at(SLAB_PASSED, SCENE_PASSED, LOOP_PASSED, which, kind, slot)
#include "generated/walk.cl"

inline void bounce_paths(SLAB_ARGS, SCENE_ARGS, LOOP_ARGS, uint which, global uint *queue, uint first, uint end)
{
    SLABS
    uint starts[BSDF_COUNT + 1], block = BLOCK;
    constant BlockWords *words = BLOCK_WORDS(which);
    bounce_show(first, end); /* light paths that begin where the camera sees */
    bounce_intersect(first, end);
    bounce_flight(first, end); /* through media, to where a path is scattered */
    bounce_deposit(first, end); /* photons */
    bounce_train(first, end); /* what guides learn from */
    bounce_mix(first, end); /* a mixture of materials is one of them */
    if (PATHS_ARE_SHADED) {
        queue_sort(path, hit, queue, starts, first, end);
        if (PATHS_WALK) bounce_walk(SLAB_PASSED, SCENE_PASSED, LOOP_PASSED, which, queue, starts, first, end);
        for (int kind = 0; kind < BSDF_COUNT; kind++) {
            uint begins = starts[kind], ends = starts[kind + 1];
            if (queue_is_dense(ends - begins, end - first)) {
                bounce_shade(kind, first, end);
                continue;
            }
            for (uint entry = begins; entry < ends; entry += LANES) {
                queue_take(path, hit, shadow, words, queue, entry, ends, block);
                bounce_shade(kind, block, block + LANES);
                queue_return(path, shadow, words, words->shadow_words, words->shadow, queue, entry, ends, block);
            }
        }
    }
    bounce_join(first, end); /* to lights or, paths from lights, to the camera */
}
