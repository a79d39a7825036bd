/* Queue 0 of the slots that `generate` or `shadow` have work for; stage/append.cl fills the queues of materials. The
 * order of the slots does not matter to the picture. */
#include "core/base.cl"
#include "transport/path_state.cl#end"

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
