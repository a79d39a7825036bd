/* Sorts the paths of a loop's work-item that met a surface by the kind of its material: a stable counting sort of slot
 * numbers, so that those of a kind ascend. */
#include "core/base.cl"
#include "interface/stage.cl"
#include "path/waiting.cl"

/* Of the slots from `at` to `end`, those that wait for kind k go to queue[starts[k]] and further, below
 * queue[starts[k + 1]]. The entries of the queue from `at` to `end` are theirs alone. */
STAGE(sort)(SLAB_ARGS, global uint *queue, uint *starts, uint end STAGE_AT_ARG)
{
    SLABS
    uint next[BSDF_COUNT], total = at;
    for (int k = 0; k < BSDF_COUNT; k++) next[k] = 0;
    for (uint slot = at; slot < end; slot++) {
        int kind = waiting_kind(path, hit, slot);
        if (kind >= 0) next[kind]++;
    }
    for (int k = 0; k < BSDF_COUNT; k++) {
        starts[k] = total;
        total += next[k];
        next[k] = starts[k];
    }
    starts[BSDF_COUNT] = total;
    for (uint slot = at; slot < end; slot++) {
        int kind = waiting_kind(path, hit, slot);
        if (kind >= 0) queue[next[kind]++] = slot;
    }
}
