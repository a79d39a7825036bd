/* The density of a cloud at the points of a lattice, which stage/brick_density.cl then makes bricks of. It is that of
 * PBRT's `cloud` (pbrt-v4, CloudMedium): five octaves of noise that thin out with the height y, over a floor that is
 * full below 1/2. Two octaves of the noise's differences shift the places where it is looked up.
 *
 * numbers: the point 0, 0, 0 in the cloud's space and the step from point to point there, x, y and z of each; how much
 * of the noise becomes cloud, how much it is shifted, cells along a unit length. values: (nx, ny, nz), z fastest. */
#define LANES 1
#define TEXTURE_PERMUTATION 0
#include "core/lanes.cl"
#include "core/math.cl"
typedef struct { global const uint *textures; } Scene;
#include "core/perlin_noise.cl"
#define CLOUD_OCTAVES 5
#define CLOUD_SHIFTS 2
#include "generated/cloud_octaves.cl"
#define CLOUD_NEAR 0.01f /* differences are over this much */

inline vec3 cloud_shift(Scene scene, vec3 p)
{
    float n = perlin_noise(scene, p);
    vec3 x = v3(p.x + CLOUD_NEAR, p.y, p.z), y = v3(p.x, p.y + CLOUD_NEAR, p.z), z = v3(p.x, p.y, p.z + CLOUD_NEAR);
    vec3 d = v3(perlin_noise(scene, x) - n, perlin_noise(scene, y) - n, perlin_noise(scene, z) - n);
    return scale3(d, 1.0f / CLOUD_NEAR);
}

/* One work-item a point. */
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
