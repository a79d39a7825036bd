/* Keys sorted stably by digits (Satish, Harris and Garland 2009): a group has a tile of neighbours, and a work-item a
 * share of the tile. Where a group is a work-item, as on CPUs, a tile is long and a digit has many bits.
 *
 * counters: a counter for each digit and work-item, digit by digit; numbers: a number for each digit and tile, digit
 * by digit, which scan_sums turns into positions. */
#include "bvh/hints.cl"
#include "bvh/scan.cl"

inline uint sort_digit(ulong key, uint shift, uint bits) { return key >> shift & ((1u << bits) - 1); }

/* Counts a work-item's keys by digits. */
inline void sort_tally(global const ulong *keys, uint2 share, uint shift, uint bits, local uint *counters)
{
    uint lane = get_local_id(0), size = get_local_size(0);
    for (uint k = 0; k < 1u << bits; k++) counters[k * size + lane] = 0;
    for (uint i = share.x; i < share.y; i++) counters[sort_digit(keys[i], shift, bits) * size + lane]++;
    barrier(CLK_LOCAL_MEM_FENCE);
}

/* Counts the digits of a tile. */
kernel NO_VECTORIZE void sort_count(global const ulong *restrict keys, uint count, uint tile, uint tiles, uint shift,
                                    uint bits, global uint *restrict numbers, local uint *counters)
{
    sort_tally(keys, scan_tile(tile, count), shift, bits, counters);
    if (get_group_id(0) >= tiles) return;
    uint size = get_local_size(0);
    for (uint k = get_local_id(0); k < 1u << bits; k += size) {
        uint sum = 0;
        for (uint lane = 0; lane < size; lane++) sum += counters[k * size + lane];
        numbers[k * tiles + get_group_id(0)] = sum;
    }
}

/* Moves a tile's keys to their positions. */
kernel NO_VECTORIZE void sort_move(global const ulong *restrict keys, uint count, uint tile, uint tiles, uint shift,
                                   uint bits, global const uint *restrict numbers, global ulong *restrict sorted,
                                   local uint *counters)
{
    uint2 share = scan_tile(tile, count);
    sort_tally(keys, share, shift, bits, counters);
    uint lane = get_local_id(0), size = get_local_size(0);
    for (uint k = lane; k < 1u << bits; k += size) {
        uint at = get_group_id(0) < tiles ? numbers[k * tiles + get_group_id(0)] : 0;
        for (uint i = k * size; i < (k + 1) * size; i++) {
            uint number = counters[i];
            counters[i] = at;
            at += number;
        }
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint i = share.x; i < share.y; i++)
        sorted[counters[sort_digit(keys[i], shift, bits) * size + lane]++] = keys[i];
}
