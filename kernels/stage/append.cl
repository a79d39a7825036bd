/* Gathers the paths that met a surface by the kind of its material, a queue for each, `slots` words each. Before
 * and after, queue 0 is for the slots that other stages have work for. A group of work-items counts the paths of each
 * kind in local memory, and reserves room for all of them with a single addition to a kind's count. The order of the
 * groups does not matter to the picture. */
#include "core/base.cl"
#include "transport/queue.cl#waiting"
#include "transport/path_state.cl#end"

/* Empty queues; a work-item for each. */
kernel void append_begin(global uint *queue_starts, global uint *queue_counts, uint slots)
{
    uint kind = get_global_id(0);
    queue_starts[kind] = kind * slots;
    queue_counts[kind] = 0;
}

kernel void append(SLAB_ARGS, global uint *queue, global uint *queue_counts, uint slots)
{
    SLABS
    local uint tally[BSDF_COUNT], begin[BSDF_COUNT];
    uint own = get_local_id(0), slot = get_global_id(0), rank = 0;
    /* A single work-item does this for all kinds: a group may be smaller than their number. */
    if (own == 0)
        for (uint k = 0; k < BSDF_COUNT; k++) tally[k] = 0;
    barrier(CLK_LOCAL_MEM_FENCE);
    int kind = slot < slots ? waiting_kind(path, hit, slot) : -1;
    if (kind >= 0) rank = atomic_inc(&tally[kind]);
    barrier(CLK_LOCAL_MEM_FENCE);
    if (own == 0)
        for (uint k = 0; k < BSDF_COUNT; k++) begin[k] = tally[k] ? atomic_add(&queue_counts[k], tally[k]) : 0;
    barrier(CLK_LOCAL_MEM_FENCE);
    if (kind >= 0) queue[kind * slots + begin[kind] + rank] = slot;
}

/* Puts the slots of a group that have work into queue 0. reserved: two words. */
inline void append_some(local uint *reserved, uint slot, int works, global uint *queue, global uint *queue_counts)
{
    uint rank = 0;
    if (get_local_id(0) == 0) reserved[0] = 0;
    barrier(CLK_LOCAL_MEM_FENCE);
    if (works) rank = atomic_inc(reserved);
    barrier(CLK_LOCAL_MEM_FENCE);
    if (get_local_id(0) == 0 && reserved[0]) reserved[1] = atomic_add(queue_counts, reserved[0]);
    barrier(CLK_LOCAL_MEM_FENCE);
    if (works) queue[reserved[1] + rank] = slot;
}

/* The slots whose paths have ended, for `generate`. */
kernel void append_ended(SLAB_ARGS, global uint *queue, global uint *queue_counts, uint slots)
{
    SLABS
    local uint reserved[2];
    uint slot = get_global_id(0);
    append_some(reserved, slot, slot < slots && path_end(path, hit, slot).ended, queue, queue_counts);
}

/* The slots whose shadow rays wait, for `shadow`. */
kernel void append_shadows(SLAB_ARGS, global uint *queue, global uint *queue_counts, uint slots)
{
    SLABS
    local uint reserved[2];
    uint slot = get_global_id(0);
    append_some(reserved, slot, slot < slots && load_shadow_t(shadow, slot) > 0.0f, queue, queue_counts);
}
