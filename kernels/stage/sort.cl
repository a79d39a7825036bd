/* Sorts the paths that met a surface by the kind of its material: a stable counting sort of slot
 * indices, so that a kind's indices ascend. Every work-item counts a chunk of neighbouring
 * slots and later puts them into the queue; in between, one work-item sums. No atomics, no barriers. */
#include "core/base.cl"
#include "path/waiting.cl"

/* counts[kind * chunks + chunk]: how many of a chunk's slots wait for a kind. */
kernel void sort_count(SLAB_ARGS, global uint *counts, uint chunk, uint slots)
{
    SLABS
    uint id = get_global_id(0), chunks = get_global_size(0), tally[BSDF_COUNT];
    for (int k = 0; k < BSDF_COUNT; k++) tally[k] = 0;
    for (uint slot = id * chunk; slot < min((id + 1) * chunk, slots); slot++) {
        int kind = waiting_kind(path, hit, slot);
        if (kind >= 0) tally[kind]++;
    }
    for (int k = 0; k < BSDF_COUNT; k++) counts[k * chunks + id] = tally[k];
}

/* Turns counts into positions in the queue, and tells where each kind begins and how long it is. */
kernel void sort_scan(global uint *counts, global uint *queue_starts, global uint *queue_counts, uint chunks)
{
    uint total = 0;
    for (int k = 0; k < BSDF_COUNT; k++) {
        queue_starts[k] = total;
        for (uint i = k * chunks; i < (k + 1) * chunks; i++) {
            uint n = counts[i];
            counts[i] = total;
            total += n;
        }
        queue_counts[k] = total - queue_starts[k];
    }
}

kernel void sort_place(SLAB_ARGS, global const uint *counts, global uint *queue, uint chunk, uint slots)
{
    SLABS
    uint id = get_global_id(0), chunks = get_global_size(0), next[BSDF_COUNT];
    for (int k = 0; k < BSDF_COUNT; k++) next[k] = counts[k * chunks + id];
    for (uint slot = id * chunk; slot < min((id + 1) * chunk, slots); slot++) {
        int kind = waiting_kind(path, hit, slot);
        if (kind >= 0) queue[next[kind]++] = slot;
    }
}
