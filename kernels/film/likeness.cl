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
