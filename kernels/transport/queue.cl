/* The queue of a loop's work-item: its slots sorted by the kind of material that shades them. For SIMD shading the
 * state of LANES slots is copied to a block, LANES neighbouring slots beyond all paths, and back. */

/* Step. */
#include "transport/queue.cl#waiting"
#include "generated/block.cl"
#include "generated/slab_words.cl"

/* Sorts the slots from `first` to `end` by a counting sort: slots of kind k go to queue[starts[k]] up to, but without,
 * queue[starts[k + 1]], in ascending order. Queue entries from `first` to `end` belong to this work-item. */
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

/* Whether so many slots wait for a kind that it is faster to shade all slots in place, with other kinds masked out. */
inline int queue_is_dense(uint waiting, uint slots) { return 4 * waiting > 3 * slots; }

/* Copies the paths from `entry` of the queue on, up to `end`, to a block; the last path fills the remaining lanes. Of
 * the shadow ray only t is copied, which marks lanes without a shadow ray. */
called void queue_take(Slab path, Slab hit, Slab shadow, constant BlockWords *words, global const uint *queue,
                       uint entry, uint end, uint block)
{
    integer slots = gather_i(queue, min_i(LANE_INDEX + (int)entry, (integer)((int)end - 1)));
    for (uint i = 0; i < words->path; i++) slab_gather(path, words->path_words[i], slots, block);
    for (uint i = 0; i < words->hit; i++) slab_gather(hit, words->hit_words[i], slots, block);
    slab_gather(shadow, SHADOW_T_WORD, slots, block);
#if USES_LAYERS || LIGHT_LAYERS /* shading adds to pixels, so copies of the last path are inactive */
    store_path_state(path, block, LANE_INDEX + (int)entry >= (int)end, (integer)(0));
#endif
}

/* Copies back the words that may have changed: of paths, and `more_count` words of another slab: shadow rays after
 * shading, or hits after a walk, whose shadow rays have been traced. */
called void queue_return(Slab path, Slab more, constant BlockWords *words, constant uchar *more_words, uint more_count,
                         global const uint *queue, uint entry, uint end, uint block)
{
    integer index = LANE_INDEX + (int)entry, slots = gather_i(queue, min_i(index, (integer)((int)end - 1)));
    mask active = index < (int)end;
    for (uint i = 0; i < words->changed; i++) slab_scatter(path, words->path_words[i], block, slots, active);
    for (uint i = 0; i < more_count; i++) slab_scatter(more, more_words[i], block, slots, active);
}

/* Step waiting: the kind of material that shades the path of a slot. */
#include "shapes/surface.cl#flags"

/* The kind, -1 for a path that waits for no material. */
inline integer waiting_kind(Slab path, Slab hit, uint at)
{
    mask waits = ((load_path_state(path, at) & PATH_ALIVE) != 0) & (load_hit_prim(hit, at) >= 0);
    return sel_i(waits, MATERIAL_KIND(load_hit_material(hit, at)), (integer)(-1));
}
