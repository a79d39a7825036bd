/* Turns the histogram of each row to cumulative sums: see transport/guiding/guide.cl. */
#include "bvh/hints.cl"
#include "transport/guiding/guide.cl#bins"

kernel NO_VECTORIZE void guide_sum(global uint *restrict guide)
{
    global uint *row = guide + get_global_id(0) * GUIDE_BINS;
    global uint *straight = guide + get_global_size(0) * GUIDE_BINS + get_global_id(0);
    *straight = as_uint((float)*straight);
    float sum = 0.0f;
    for (uint k = 0; k < GUIDE_BINS; k++) {
        sum += (float)row[k];
        row[k] = as_uint(sum);
    }
}
