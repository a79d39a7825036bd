/* The bounce loop on the device: every work-item takes `share` neighbouring slots through all stages, again and again
 * until they are at the end of their work lists, or `bounces` times. The slots of a launch begin at the slot `begin`:
 * where bounces take long, a launch takes a part of the slots. On a CPU it is a core's own small wavefront: its
 * paths stay in the core's cache, and are sorted by material before they are shaded. The host need not wait for a count
 * of the rest, so it can enqueue a whole exposure at once; `restart` begins the lists. `which` is the kind of paths,
 * where a scene has paths from lights (0) and from the camera (1). The host raises `leave` while the loop runs, if the
 * paths are of no use any more, or if the launch takes too long; a null pointer is never raised. The stages are those
 * of the other files here, each compiled by itself as a function (stage/stage.cl), in its own number of lanes, and
 * linked. */
#include "stage/stage.cl"
#include "generated/loop_args.cl"
#include "transport/queue.cl"
#include "generated/bounce_stages.cl"

/* Whether a slot waits for a stage that takes single slots: to ask is cheaper than to call the stage. */
inline uint slot_word(Slab s, uint word, uint slot) { return as_uint(*slab_at(s, word, slot)); }
inline int slot_flies(Slab path, uint slot) { return (slot_word(path, PATH_STATE_WORD, slot) & PATH_ALIVE) != 0; }
inline int slot_joins(Slab shadow, uint slot) { return as_float(slot_word(shadow, SHADOW_T_WORD, slot)) > 0.0f; }
#include "generated/reuse_due.cl"

/* A bounce of the paths of a work-item: the slots from `first` to `end` go through all stages but the beginning of
 * paths. Each verb `bounce_...` takes slots through a stage for the kind of paths, and does nothing where no path of
 * the scene has that stage. Before they are shaded, the slots are sorted by material, so that a block of LANES slots
 * has a single kind; where nearly all wait for the same kind they are shaded as they lie. */
#define BLOCK (settings->slots + get_global_id(0) * LANES) /* the first slot of the work-item's block */
#define bounce_shade(kind, first, end)                 \
    for (uint slot = first; slot < end; slot += LANES) \
        bounce_shade_at(SLAB_PASSED, SCENE_PASSED, LOOP_PASSED, which, kind, slot)
#include "generated/walk.cl"

inline void bounce_paths(SLAB_ARGS, SCENE_ARGS, LOOP_ARGS, uint which, global uint *queue, uint first, uint end,
                         global const volatile uint *leave)
{
    SLABS
    uint starts[BSDF_COUNT + 1], block = BLOCK;
    constant BlockWords *words = BLOCK_WORDS(which);
    bounce_show(first, end); /* light paths that begin where the camera sees */
    bounce_intersect(first, end);
    bounce_flight(first, end); /* through media, to where a path is scattered */
    bounce_deposit(first, end); /* photons */
    bounce_train(first, end); /* of guides */
    bounce_mix(first, end); /* a material of a mixture is chosen */
    if (PATHS_ARE_SHADED) {
        queue_sort(path, hit, queue, starts, first, end);
        if (PATHS_WALK) bounce_walk(SLAB_PASSED, SCENE_PASSED, LOOP_PASSED, which, queue, starts, first, end, leave);
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
    bounce_reuse(first, end); /* paths share their second vertices */
}

kernel NO_VECTORIZE void loop(SLAB_ARGS, SCENE_ARGS, LOOP_ARGS, global uint *queue, uint share, uint begin,
                              uint bounces, uint restart, uint which, global const volatile uint *leave)
{
    SLABS
    uint first = begin + get_global_id(0) * share, end = min(first + share, (uint)settings->slots);
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
        bounce_paths(SLAB_PASSED, SCENE_PASSED, LOOP_PASSED, which, queue, first, end, leave);
    }
}
