/* How alike two pixels are, for a mean over those that see the same light.
 *
 * Each pixel has the mean of its samples and an estimate of that mean's variance. Welch's statistic of two means,
 * (a - b)^2 / (var(a) + var(b)), is 1 on average where both have the same expected value (Sakai et al. 2024, "A
 * Statistical Approach to Monte Carlo Denoising", use it to decide which neighbours to average). Here it is averaged
 * over the 3x3 pixels around both and over three channels, which tells more than one pixel, as non-local means do
 * (Rousselle et al. 2012), and a pixel counts the less the larger that is.
 *
 * Noise of light is as large as light, and has rare high values: statistics are those of asinh(v / scale), which is
 * linear in the dark and logarithmic above (Sakai et al. take a Box-Cox transformation for the same purpose). */
#define PATCH 1      /* pixels beside one that are compared with it, to each side */
#define PATCH_TERMS 27.0f

/* A pixel near the border stands for those beyond it. */
inline size_t denoise_index(int2 size, int x, int y)
{
    return (size_t)clamp(y, 0, size.y - 1) * size.x + clamp(x, 0, size.x - 1);
}

/* Welch's statistic of the patches around two pixels; guide: transformed means; variance: of these. */
inline float patch_statistic(global const float4 *guide, global const float4 *variance, int2 size, int2 a, int2 b)
{
    float sum = 0.0f;
    for (int y = -PATCH; y <= PATCH; y++)
        for (int x = -PATCH; x <= PATCH; x++) {
            size_t i = denoise_index(size, a.x + x, a.y + y), j = denoise_index(size, b.x + x, b.y + y);
            float4 apart = guide[i] - guide[j], term = apart * apart / (variance[i] + variance[j]);
            sum += term.x + term.y + term.z;
        }
    return sum / PATCH_TERMS;
}

/* How much of a neighbour's light counts, by a statistic: half at `limit`, then less by its power 2 * sharpness. */
inline float likeness(float statistic, float limit, int sharpness)
{
    float ratio = statistic / limit, square = ratio * ratio, power = 1.0f;
    for (int i = 0; i < sharpness; i++) power *= square;
    return 1.0f / (1.0f + power);
}

/* The mean of the square of a colour. */
inline float colour_square(float4 v) { return (v.x * v.x + v.y * v.y + v.z * v.z) / 3.0f; }
