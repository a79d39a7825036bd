/* Averages over pixels that see the same light take noise away (clpt/denoise/statistical.py). All pictures are of four
 * floats a pixel; the fourth is padding unless a comment names it.
 *
 * Each pixel has the mean of its samples and an estimate of that mean's variance. Welch's statistic of two means,
 * (a - b)^2 / (var(a) + var(b)), is 1 on average where both have the same expected value (Sakai et al. 2024, "A
 * Statistical Approach to Monte Carlo Denoising", use it to decide which neighbours to average). Here it is averaged
 * over the 3x3 pixels around both and over three channels, which tells more than a single pixel, as non-local means do
 * (Rousselle et al. 2012), and a pixel counts the less the larger the average is.
 *
 * Noise of light is as large as light, and has rare high values: statistics are those of asinh(v / scale), which is
 * linear in the dark and logarithmic above (Sakai et al. take a Box-Cox transformation for the same purpose). */
#include "core/lanes.cl"
#include "core/math.cl"

#define PATCH 1      /* pixels to each side of a pixel that are compared */
#define PATCH_TERMS 27.0f

/* LANES floats at any address. */
typedef real unaligned_real __attribute__((aligned(4)));
#define unaligned_load(p) (*(global const unaligned_real *)(p))

/* The square of the difference of three planes here and `step` floats away. */
inline real square_apart(global const float *image, size_t plane, int step)
{
    real x = unaligned_load(image) - unaligned_load(image + step);
    real y = unaligned_load(image + plane) - unaligned_load(image + plane + step);
    real z = unaligned_load(image + 2 * plane) - unaligned_load(image + 2 * plane + step);
    return x * x + y * y + z * z;
}

/* A row of a patch: the sum of Welch's statistic, here and `step` floats away, over three channels and the pixels from
 * PATCH to the left to PATCH to the right. guide: planes of transformed means; variance: of these. */
inline real patch_row(global const float *guide, global const float *variance, size_t plane, int step)
{
    real sum = (real)(0.0f);
    for (int x = -PATCH; x <= PATCH; x++)
        for (int channel = 0; channel < 3; channel++) {
            size_t i = channel * plane + x, j = i + step;
            real apart = unaligned_load(guide + i) - unaligned_load(guide + j);
            sum += apart * apart / (unaligned_load(variance + i) + unaligned_load(variance + j));
        }
    return sum;
}

/* How much of a neighbour's light counts, by a statistic: half at `limit`, then less by its power 2 * sharpness. */
inline real likeness(real statistic, float limit, int sharpness)
{
    real ratio = statistic / limit, square = ratio * ratio, power = (real)(1.0f);
    for (int i = 0; i < sharpness; i++) power *= square;
    return 1.0f / (1.0f + power);
}

/* The mean of the square of a colour. */
inline float colour_square(float4 v) { return (v.x * v.x + v.y * v.y + v.z * v.z) / 3.0f; }

#define RADIUS 10      /* pixels, of the disk over which a pixel is averaged */
#define BORDER (RADIUS + PATCH) /* pixels of planes beside the picture */
#define FAR_FEATURES 8.0f /* minus the logarithm of a weight that is too small to count */
#define MOST_VALUES 4  /* of four floats, that are averaged at once */
#if LANES == 1
#define ROWS 2         /* that a work-item averages: rows of patches are shared, and registers are few */
#else
#define ROWS 8
#endif
#define SURE 0.02f     /* lower limit of an error, relative to the noise */

/* Two halves' transformed mean and its variance, by their difference alone. */
kernel void denoise_guide(global const float4 *first, global const float4 *second, global float4 *guide,
                          global float4 *variance, float scale)
{
    size_t i = get_global_id(0);
    float4 a = asinh(first[i] / scale), b = asinh(second[i] / scale), half_apart = 0.5f * (a - b);
    guide[i] = 0.5f * (a + b);
    variance[i] = half_apart * half_apart;
}

/* The mean over 2 * radius + 1 pixels of a row or column, as far as they are in the picture; step: (1, 0) or (0, 1).
 * least: is added. */
kernel void denoise_blur(global const float4 *from, global float4 *into, int2 size, int2 step, int radius, float least)
{
    int x = get_global_id(0), y = get_global_id(1);
    float4 sum = (float4)(0.0f);
    float count = 0.0f;
    for (int i = -radius; i <= radius; i++) {
        int u = x + i * step.x, v = y + i * step.y;
        if (u < 0 || v < 0 || u >= size.x || v >= size.y) continue;
        sum += from[(size_t)v * size.x + u];
        count += 1.0f;
    }
    into[(size_t)y * size.x + x] = sum / count + least;
}

/* Planes of a float a pixel from a picture of `count` vectors a pixel: lanes read neighbours in a single load. `extent`
 * is the size of a plane, BORDER pixels more than the picture to each side; a pixel near the border stands for pixels
 * beyond it. */
kernel void denoise_planes(global const float *from, global float *planes, int2 size, int2 extent, int count)
{
    int x = get_global_id(0), y = get_global_id(1), plane = get_global_id(2);
    int u = clamp(x - BORDER, 0, size.x - 1), v = clamp(y - BORDER, 0, size.y - 1);
    planes[((size_t)plane * extent.y + y) * extent.x + x] = from[((size_t)v * size.x + u) * (4 * count) + plane];
}

/* For each row of a work-item: whether pixels `dx`, `dy` away are in the picture and not too far in albedo and normal,
 * and how far they are there. Returns whether any of them is near. */
inline int near_surfaces(global const float *albedo, global const float *normal, int2 first, int2 size, int2 extent,
                         int2 d, float2 features, mask *near, real *apart)
{
    size_t plane = (size_t)extent.x * extent.y;
    int step = d.y * extent.x + d.x;
    integer column = first.x + d.x + LANE_INDEX;
    mask some = mask_of(0);
    for (int row = 0; row < ROWS; row++) {
        int y = first.y + row;
        size_t at = (size_t)row * extent.x;
        apart[row] = features.x * square_apart(albedo + at, plane, step) +
                     features.y * square_apart(normal + at, plane, step);
        near[row] = (column >= 0) & (column < size.x) & !(apart[row] > FAR_FEATURES);
        near[row] = near[row] & mask_of(y + d.y >= 0 && y + d.y < size.y && y < size.y);
        some = some | near[row];
    }
    return any(some);
}

/* The weighted mean of values over the pixels around each. A work-item has LANES pixels in each of ROWS rows. All but
 * `averaged` are planes. values, averaged: `count` vectors a pixel. features: how albedo and normal count, the squares
 * of their differences. A pixel counts itself as much as the neighbour that is most alike: so a pixel with an outlier,
 * unlike all around it, still loses it. */
kernel void denoise_average(global const float *guide, global const float *variance, global const float *albedo,
                            global const float *normal, global const float *values, global float *averaged, int2 size,
                            int2 extent, int count, float2 features, float limit, int sharpness)
{
    int x = get_global_id(0) * LANES, y = get_global_id(1) * ROWS, channels = 4 * count;
    size_t plane = (size_t)extent.x * extent.y, here = (size_t)(y + BORDER) * extent.x + x + BORDER;
    real sums[ROWS][4 * MOST_VALUES], total[ROWS], largest[ROWS];
    for (int row = 0; row < ROWS; row++) {
        total[row] = (real)(0.0f);
        largest[row] = (real)(1e-6f);
        for (int k = 0; k < channels; k++) sums[row][k] = (real)(0.0f);
    }
    for (int dy = -RADIUS; dy <= RADIUS; dy++)
        for (int dx = -RADIUS; dx <= RADIUS; dx++) {
            if (dx * dx + dy * dy > RADIUS * RADIUS || (dx == 0 && dy == 0)) continue;
            int step = dy * extent.x + dx;
            mask near[ROWS];
            real apart[ROWS];
            if (!near_surfaces(albedo + here, normal + here, (int2)(x, y), size, extent, (int2)(dx, dy), features, near,
                               apart))
                continue;
            real above = patch_row(guide + here - extent.x, variance + here - extent.x, plane, step);
            real middle = patch_row(guide + here, variance + here, plane, step);
            for (int row = 0; row < ROWS; row++) {
                size_t at = here + (size_t)row * extent.x, next = at + extent.x, there = at + step;
                real below = patch_row(guide + next, variance + next, plane, step);
                real statistic = (above + middle + below) / PATCH_TERMS;
                real weight = exp_r(-apart[row]) * likeness(statistic, limit, sharpness);
                weight = sel(near[row], weight, (real)(0.0f));
                above = middle;
                middle = below;
                for (int k = 0; k < channels; k++) {
                    real value = weight * unaligned_load(values + k * plane + there);
                    sums[row][k] += sel(near[row], value, (real)(0.0f));
                }
                total[row] += weight;
                largest[row] = max_r(largest[row], weight);
            }
        }
    for (int row = 0; row < ROWS && y + row < size.y; row++)
        for (int k = 0; k < channels; k++) {
            real own = unaligned_load(values + k * plane + here + (size_t)row * extent.x);
            real mean = (sums[row][k] + largest[row] * own) / (total[row] + largest[row]);
            global float *into = averaged + ((size_t)(y + row) * size.x + x) * channels + k;
            scatter_if(into, LANE_INDEX * channels, x + LANE_INDEX < size.x, mean);
        }
}

/* The mean squares of the errors, relative to light, of two averages of halves and of the noisy picture: by the
 * distance of an average of a half from the other half, whose noise is independent. halves, once, twice: two vectors a
 * pixel. dark: the square of light added. errors: of `once`, of `twice`, of the noisy picture, 0. */
kernel void denoise_errors(global const float4 *halves, global const float4 *once, global const float4 *twice,
                           global float4 *errors, float dark)
{
    size_t i = get_global_id(0);
    float4 a = halves[2 * i], b = halves[2 * i + 1];
    float4 light = 0.5f * (once[2 * i] + once[2 * i + 1]);
    float mean = (light.x + light.y + light.z) / 3.0f, weight = 1.0f / (mean * mean + dark);
    float noise = weight * colour_square(0.5f * (a - b));
    float first = weight * 0.5f * (colour_square(once[2 * i] - b) + colour_square(once[2 * i + 1] - a));
    float second = weight * 0.5f * (colour_square(twice[2 * i] - b) + colour_square(twice[2 * i + 1] - a));
    errors[i] = (float4)(first - 2.0f * noise, second - 2.0f * noise, noise, 0.0f); /* a half has twice the noise */
}

/* The shares of both averages and of the noisy picture with the least error: inverse to the error of each. errors:
 * around each pixel; shares: of these three, then 0. */
kernel void denoise_shares(global const float4 *errors, global float4 *shares)
{
    size_t i = get_global_id(0);
    float4 e = errors[i];
    float noise = e.z, first = fmax(e.x, SURE * noise), second = fmax(e.y, SURE * noise);
    float one = 1.0f / (first * first + 1e-20f), other = 1.0f / (second * second + 1e-20f);
    float best = fmin(first, second), kept = noise > 0.0f ? noise / (noise + best) : 1.0f;
    one = one / (one + other);
    shares[i] = (float4)(kept * one, kept * (1.0f - one), 1.0f - kept, 0.0f);
}
