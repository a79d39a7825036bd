/* The queue of a loop's work-item: its slots sorted by the kind of material that they wait for. To be shaded in SIMD
 * the state of LANES of them is brought to a block, LANES neighbouring slots beyond those of the paths, and back. */
#include "transport/waiting.cl"
#include "generated/block.cl"

/* Of the slots from `first` to `end`, those that wait for kind k go to queue[starts[k]] and further, below
 * queue[starts[k + 1]], in ascending order: a counting sort. The entries from `first` to `end` are theirs alone. */
called void queue_sort(Slab path, Slab hit, global uint *queue, uint *starts, uint first, uint end)
{
    uint next[BSDF_COUNT], total = first;
    union { integer all; int each[LANES]; } kinds;
    for (int k = 0; k < BSDF_COUNT; k++) next[k] = 0;
    for (uint at = first; at < end; at += LANES) {
        kinds.all = waiting_kind(path, hit, at);
        for (uint i = 0; i < LANES; i++) {
            if (kinds.each[i] >= 0) next[kinds.each[i]]++;
        }
    }
    for (int k = 0; k < BSDF_COUNT; k++) {
        starts[k] = total;
        total += next[k];
        next[k] = starts[k];
    }
    starts[BSDF_COUNT] = total;
    for (uint at = first; at < end; at += LANES) {
        kinds.all = waiting_kind(path, hit, at);
        for (uint i = 0; i < LANES; i++) {
            if (kinds.each[i] >= 0) queue[next[kinds.each[i]]++] = at + i;
        }
    }
}

/* Whether so many slots wait for a kind that it is quicker to shade all neighbours as they lie, others masked out. */
inline int queue_is_dense(uint waiting, uint slots) { return 4 * waiting > 3 * slots; }

/* Brings the paths from `entry` of the queue on, of which the last one is before `end`, to a block; that one fills what
 * is left. Of the shadow ray only t is brought, by which the others are known to hold nothing. */
called void queue_take(Slab path, Slab hit, Slab shadow, constant BlockWords *words, global const uint *queue,
                       uint entry, uint end, uint block)
{
    integer slots = gather_i(queue, min_i(LANE_INDEX + (int)entry, (integer)((int)end - 1)));
    for (uint i = 0; i < words->path; i++) slab_gather(path, words->path_words[i], slots, block);
    for (uint i = 0; i < words->hit; i++) slab_gather(hit, words->hit_words[i], slots, block);
    slab_gather(shadow, SHADOW_T, slots, block);
#if USES_LAYERS || LIGHT_LAYERS /* shading adds to pixels: the last path only once */
    store_path_state(path, block, LANE_INDEX + (int)entry >= (int)end, (integer)(0));
#endif
}

/* Brings back what may have changed: of paths, and `more_count` words of another slab. These are shadow rays after
 * shading, and hits after a walk, whose shadow rays have been tested. */
called void queue_return(Slab path, Slab more, constant BlockWords *words, constant uchar *more_words, uint more_count,
                         global const uint *queue, uint entry, uint end, uint block)
{
    integer index = LANE_INDEX + (int)entry, slots = gather_i(queue, min_i(index, (integer)((int)end - 1)));
    mask active = index < (int)end;
    for (uint i = 0; i < words->changed; i++) slab_scatter(path, words->path_words[i], block, slots, active);
    for (uint i = 0; i < more_count; i++) slab_scatter(more, more_words[i], block, slots, active);
}
