/* Gathers the paths that met a surface by the kind of its material, a queue for each, `slots` words each. A
 * group of work-items counts the paths of each kind in local memory, and reserves room for all of
 * them with a single addition to a kind's count. The order of the groups does not matter to the picture. */
#include "core/base.cl"
#include "transport/queue.cl#waiting"

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
