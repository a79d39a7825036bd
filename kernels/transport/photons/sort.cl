/* Photons sorted by the cells where they are, so that each cell's are found at once: a counting sort.
 *
 * numbers: of the cell of each place, PHOTON_NONE where there is no photon. cells: one word more than there are cells;
 * in the end those of cell k are order[cells[k]] and further, below order[cells[k + 1]], in ascending order. */
#include "bvh/hints.cl"
#include "generated/photon_numbers.cl"

/* How many photons are in each cell; cells: zeros. */
kernel NO_VECTORIZE void photons_count(global const uint *restrict numbers, uint count, global uint *restrict cells)
{
    uint place = get_global_id(0);
    if (place < count && numbers[place] != PHOTON_NONE) atomic_inc(cells + 1 + numbers[place]);
}

kernel NO_VECTORIZE void photons_sum(global const uint *restrict cells, uint count, global uint *restrict sums)
{
    uint begin = get_global_id(0) * PHOTON_RUN, end = min(begin + PHOTON_RUN, count), sum = 0;
    for (uint k = begin; k < end; k++) sum += cells[1 + k];
    sums[get_global_id(0)] = sum;
}

/* Sums made positions, by one work-item. */
kernel NO_VECTORIZE void photons_scan(global uint *restrict sums, uint runs)
{
    uint total = 0;
    for (uint run = 0; run < runs; run++) {
        uint sum = sums[run];
        sums[run] = total;
        total += sum;
    }
}

/* Of each cell where its photons begin. */
kernel NO_VECTORIZE void photons_begin(global uint *restrict cells, uint count, global const uint *restrict sums)
{
    uint begin = get_global_id(0) * PHOTON_RUN, end = min(begin + PHOTON_RUN, count), at = sums[get_global_id(0)];
    for (uint k = begin; k < end; k++) {
        uint number = cells[1 + k];
        cells[1 + k] = at;
        at += number;
    }
}

/* Photons put in their cells, and where these begin made where they end. */
kernel NO_VECTORIZE void photons_place(global const uint *restrict numbers, uint count, global uint *restrict cells,
                                       global uint *restrict order)
{
    uint place = get_global_id(0);
    if (place < count && numbers[place] != PHOTON_NONE) order[atomic_inc(cells + 1 + numbers[place])] = place;
}

/* Lets what is at k sink in a heap of n, the largest on top. */
inline void photons_sink(global uint *order, uint k, uint n)
{
    uint value = order[k];
    for (uint child = 2 * k + 1; child < n; child = 2 * k + 1) {
        if (child + 1 < n && order[child + 1] > order[child]) child++;
        if (order[child] <= value) break;
        order[k] = order[child];
        k = child;
    }
    order[k] = value;
}

/* The photons of a cell in ascending order: they were put there in any. */
kernel NO_VECTORIZE void photons_order(global const uint *restrict cells, uint count, global uint *restrict order)
{
    uint cell = get_global_id(0);
    if (cell >= count) return;
    order += cells[cell];
    uint n = cells[cell + 1] - cells[cell];
    for (uint k = n / 2; k > 0; k--) photons_sink(order, k - 1, n);
    for (uint k = n; k > 1; k--) {
        uint largest = order[0];
        order[0] = order[k - 1];
        order[k - 1] = largest;
        photons_sink(order, 0, k - 1);
    }
}
