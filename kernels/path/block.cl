/* A block: LANES neighbouring slots beyond those of the paths. The state of any LANES paths is brought there to be
 * shaded as neighbours, and back. Where a work-item shades one path, its slot is the block. */

/* Brings the paths from `entry` of a queue on, of which the last one is before `end`; returns where they are. */
inline uint block_take(Slab path, Slab hit, Slab shadow, global const uint *queue, uint entry, uint end, uint block)
{
#if LANES == 1
    return queue[entry];
#else
    integer slot = gather_i(queue, min_i(LANE_INDEX + (int)entry, (integer)((int)end - 1)));
    for (uint c = 0; c < PATH_SUMS; c++) slab_gather(path, c, slot, block);
    for (uint c = 0; c < HIT_WORDS; c++) slab_gather(hit, c, slot, block);
    for (uint c = 0; c < SHADOW_WORDS; c++) slab_gather(shadow, c, slot, block);
    return block;
#endif
}

/* Brings back what shading has changed. */
inline void block_return(Slab path, Slab shadow, global const uint *queue, uint entry, uint end, uint block)
{
#if LANES > 1
    integer index = LANE_INDEX + (int)entry, slot = gather_i(queue, min_i(index, (integer)((int)end - 1)));
    for (uint c = 0; c < PATH_SUMS; c++) slab_scatter(path, c, block, slot, index < (int)end);
    for (uint c = 0; c < SHADOW_WORDS; c++) slab_scatter(shadow, c, block, slot, index < (int)end);
#endif
}
