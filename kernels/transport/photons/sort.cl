/* Sorts photons by their cells with a counting sort.
 *
 * numbers: the cell of each photon, PHOTON_NONE for an empty place. cells: a word more than there are cells; afterwards
 * the photons of cell k are order[cells[k]] up to, but without, order[cells[k + 1]], in ascending order. */
#include "bvh/hints.cl"
#include "generated/photon_numbers.cl"

/* Counts the photons of each cell; cells: zeros. */
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

/* Exclusive scan of the sums, by a single work-item. */
kernel NO_VECTORIZE void photons_scan(global uint *restrict sums, uint runs)
{
    uint total = 0;
    for (uint run = 0; run < runs; run++) {
        uint sum = sums[run];
        sums[run] = total;
        total += sum;
    }
}

/* The first photon of each cell. */
kernel NO_VECTORIZE void photons_begin(global uint *restrict cells, uint count, global const uint *restrict sums)
{
    uint begin = get_global_id(0) * PHOTON_RUN, end = min(begin + PHOTON_RUN, count), at = sums[get_global_id(0)];
    for (uint k = begin; k < end; k++) {
        uint number = cells[1 + k];
        cells[1 + k] = at;
        at += number;
    }
}

/* Places photons in their cells; `cells` advances from the first photon of each cell to the end. */
kernel NO_VECTORIZE void photons_place(global const uint *restrict numbers, uint count, global uint *restrict cells,
                                       global uint *restrict order)
{
    uint place = get_global_id(0);
    if (place < count && numbers[place] != PHOTON_NONE) order[atomic_inc(cells + 1 + numbers[place])] = place;
}

/* Sifts entry k down in a max-heap of n entries. */
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

/* Sorts the photons of a cell in ascending order. */
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
