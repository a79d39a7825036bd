/* Densities on the device. */

/* Step bricks: a density becomes the bricks of kernels/media/medium_grid.cl, which has their form: here every brick has
 * points, whether it holds any density or not, so that nobody need know before. The numbers are to the bit those of
 * clpt.render.media.grids.
 *
 * values: (nx, ny, nz) from `begin` on, z fastest; a negative value, and a value that is not finite, counts as 0.
 * Bricks lie x fastest, `bricks_x` and `bricks_y` of them along these axes, from the word `first` of `images` on. */
#include "generated/brick_cells.cl"
#include "generated/brick_sizes.cl"
#define BRICK_ALL 729u  /* points */
#define BRICK_LARGEST 1e30f

typedef struct {
    uint nx, ny, nz, x, y, z; /* of the density; the brick's first point lies a step before these */
} Brick;

inline Brick brick_at(uint nx, uint ny, uint nz, uint bricks_x, uint bricks_y, uint i)
{
    Brick b = {nx, ny, nz, i % bricks_x, i / bricks_x % bricks_y, i / (bricks_x * bricks_y)};
    b.x *= BRICK_CELLS;
    b.y *= BRICK_CELLS;
    b.z *= BRICK_CELLS;
    return b;
}

inline uint brick_index(uint first, uint point, uint size)
{
    uint i = first + point;
    return min(i > 0u ? i - 1u : 0u, size - 1u);
}

inline float brick_value(global const float *values, Brick b, uint point)
{
    uint x = brick_index(b.x, point % BRICK_POINTS, b.nx);
    uint y = brick_index(b.y, point / BRICK_POINTS % BRICK_POINTS, b.ny);
    uint z = brick_index(b.z, point / (BRICK_POINTS * BRICK_POINTS), b.nz);
    float v = values[((ulong)x * b.ny + y) * b.nz + z];
    return v > 0.0f && v < BRICK_LARGEST ? v : 0.0f;
}

/* The first word of the points of each brick, and its highest density. A work-item a brick. */
kernel void brick_bounds(global const float *restrict values, uint begin, uint nx, uint ny, uint nz, uint bricks_x,
                         uint bricks_y, uint first, uint count, global uint *restrict images)
{
    uint i = get_global_id(0);
    if (i >= count) return;
    Brick b = brick_at(nx, ny, nz, bricks_x, bricks_y, i);
    float most = 0.0f;
    for (uint p = 0; p < BRICK_ALL; p++) most = fmax(most, brick_value(values + begin, b, p));
    images[first + 2 * i] = 2 * count + BRICK_WORDS * i;
    images[first + 2 * i + 1] = as_uint(most);
}

/* The integer nearest to 65535 value / most: the remainder corrects the rounding of the division. */
inline uint brick_quantum(float value, float most)
{
    if (most <= 0.0f) return 0u;
    float q = rint(value / most * 65535.0f);
    float high = value * 65535.0f, low = fma(value, 65535.0f, -high);
    float rest = fma(-q, most, high) + low;
    q += rest > 0.5f * most ? 1.0f : rest < -0.5f * most ? -1.0f : 0.0f;
    return (uint)clamp(q, 0.0f, 65535.0f);
}

/* Two points a word. A work-item a word. */
kernel void brick_points(global const float *restrict values, uint begin, uint nx, uint ny, uint nz, uint bricks_x,
                         uint bricks_y, uint first, uint bricks, uint count, global uint *restrict images)
{
    uint i = get_global_id(0);
    if (i >= count) return;
    uint brick = i / BRICK_WORDS, p = 2 * (i % BRICK_WORDS);
    Brick b = brick_at(nx, ny, nz, bricks_x, bricks_y, brick);
    float most = as_float(images[first + 2 * brick + 1]);
    uint word = brick_quantum(brick_value(values + begin, b, p), most);
    if (p + 1 < BRICK_ALL) word |= brick_quantum(brick_value(values + begin, b, p + 1), most) << 16;
    images[first + 2 * bricks + i] = word;
}

/* Step cloud: the density of a cloud at the points of a lattice, for step `bricks`. It is the density of PBRT's `cloud`
 * (pbrt-v4, CloudMedium): five octaves of noise that thin out with the height y, over a floor that is
 * full below 1/2. Two octaves of the noise's differences shift the points of its look-up.
 *
 * numbers: the point 0, 0, 0 in the cloud's space and the step from point to point there, x, y and z of each; the share
 * of the noise that becomes cloud, the shift, cells along a unit length. values: (nx, ny, nz), z fastest. */
#define LANES 1
#define TEXTURE_PERMUTATION 0
#include "core/lanes.cl"
#include "core/math.cl"
typedef struct { global const uint *textures; } Scene;
#include "core/perlin_noise.cl"
#define CLOUD_OCTAVES 5
#define CLOUD_SHIFTS 2
#include "generated/cloud_octaves.cl"
#define CLOUD_NEAR 0.01f /* step of differences */

inline vec3 cloud_shift(Scene scene, vec3 p)
{
    float n = perlin_noise(scene, p);
    vec3 x = v3(p.x + CLOUD_NEAR, p.y, p.z), y = v3(p.x, p.y + CLOUD_NEAR, p.z), z = v3(p.x, p.y, p.z + CLOUD_NEAR);
    vec3 d = v3(perlin_noise(scene, x) - n, perlin_noise(scene, y) - n, perlin_noise(scene, z) - n);
    return scale3(d, 1.0f / CLOUD_NEAR);
}

/* A work-item a point. */
kernel void cloud_density(global const float *restrict numbers, global const uint *restrict permutation, uint nx,
                          uint ny, uint nz, uint count, global float *restrict values)
{
    uint i = get_global_id(0);
    if (i >= count) return;
    Scene scene = {permutation};
    uint z = i % nz, y = i / nz % ny, x = i / (ny * nz);
    float height = numbers[1] + numbers[4] * (float)y;
    vec3 p = v3(numbers[0] + numbers[3] * (float)x, height, numbers[2] + numbers[5] * (float)z);
    p = scale3(p, numbers[8]);
    float strength = 0.05f * numbers[7], finer = 10.0f;
    for (int octave = 0; octave < CLOUD_SHIFTS && strength > 0.0f; octave++) {
        p = madd3(cloud_shift(scene, scale3(p, finer)), strength, p);
        strength *= 0.5f;
        finer *= CLOUD_FINER;
    }
    float sum = 0.0f;
    strength = 0.5f;
    finer = 1.0f;
    for (int octave = 0; octave < CLOUD_OCTAVES; octave++) {
        sum += strength * perlin_noise(scene, scale3(p, finer));
        strength *= 0.5f;
        finer *= CLOUD_FINER;
    }
    float d = clamp((1.0f - height) * 4.5f * numbers[6] * sum, 0.0f, 1.0f);
    values[i] = clamp(d + 2.0f * fmax(0.0f, 0.5f - height), 0.0f, 1.0f);
}
