/* Takes noise away by averages over pixels that see the same light (clpt/denoise/statistical.py). All pictures are of
 * four floats a pixel, of which the fourth is padding but where it is named. */
#include "denoising/likeness.cl"

#define RADIUS 10      /* pixels, of the disk over which a pixel is averaged */
#define FAR_FEATURES 8.0f /* minus the logarithm of a weight that is too small to count */
#define MOST_VALUES 8  /* of four floats, that are averaged at once */
#define SURE 0.02f     /* no error is thought to be smaller, relative to the noise */

/* Two halves' transformed mean and its variance, by their difference alone. */
kernel void denoise_guide(global const float4 *first, global const float4 *second, global float4 *guide,
                          global float4 *variance, float scale)
{
    size_t i = get_global_id(0);
    float4 a = asinh(first[i] / scale), b = asinh(second[i] / scale), half_apart = 0.5f * (a - b);
    guide[i] = 0.5f * (a + b);
    variance[i] = half_apart * half_apart;
}

/* The mean over 2 * radius + 1 pixels of a row or column, or those of them that are there; step: (1, 0) or (0, 1).
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

/* The weighted mean of values over the pixels around each. values, averaged: `count` vectors a pixel. features: how
 * albedo and normal count, the squares of their differences. A pixel counts itself as much as the neighbour that is
 * most alike: so one with an outlier, like nothing around it, still loses it. */
kernel void denoise_average(global const float4 *guide, global const float4 *variance, global const float4 *albedo,
                            global const float4 *normal, global const float4 *values, global float4 *averaged,
                            int2 size, int count, float2 features, float limit, int sharpness)
{
    int x = get_global_id(0), y = get_global_id(1);
    size_t here = (size_t)y * size.x + x;
    float4 own_albedo = albedo[here], own_normal = normal[here], sums[MOST_VALUES];
    float total = 0.0f, largest = 1e-6f;
    for (int k = 0; k < count; k++) sums[k] = (float4)(0.0f);
    for (int dy = -RADIUS; dy <= RADIUS; dy++)
        for (int dx = -RADIUS; dx <= RADIUS; dx++) {
            int u = x + dx, v = y + dy;
            if (dx * dx + dy * dy > RADIUS * RADIUS || u < 0 || v < 0 || u >= size.x || v >= size.y) continue;
            size_t there = (size_t)v * size.x + u;
            float4 of_albedo = own_albedo - albedo[there], of_normal = own_normal - normal[there];
            float apart = features.x * dot(of_albedo, of_albedo) + features.y * dot(of_normal, of_normal);
            if (apart > FAR_FEATURES || there == here) continue;
            float statistic = patch_statistic(guide, variance, size, (int2)(x, y), (int2)(u, v));
            float weight = exp(-apart) * likeness(statistic, limit, sharpness);
            for (int k = 0; k < count; k++) sums[k] += weight * values[there * count + k];
            total += weight;
            largest = fmax(largest, weight);
        }
    for (int k = 0; k < count; k++)
        averaged[here * count + k] = (sums[k] + largest * values[here * count + k]) / (total + largest);
}

/* The mean squares of what is wrong, relative to light, of two averages of halves and of the noisy picture: by how far
 * an average of one half is from the other half, whose noise is its own. halves, once, twice: two vectors a pixel.
 * dark: the square of light added. errors: of `once`, of `twice`, of the noisy picture, 0. */
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

/* How much of both averages and of the noisy picture makes the least error: inverse to what each has. errors: around
 * each pixel; shares: of these three, then 0. */
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
