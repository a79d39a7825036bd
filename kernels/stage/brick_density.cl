/* A density on the device becomes the bricks of kernels/media/medium_grid.cl, which has their form: here every brick
 * has points, whether it holds any density or not, so that nobody need know before. The numbers are to the bit those of
 * clpt.render.media.grids.
 *
 * values: (nx, ny, nz) from `begin` on, z fastest; what is negative or not finite counts as 0. Bricks lie x fastest,
 * `bricks_x` and `bricks_y` of them along these axes, from the word `first` of `images` on.
 */
#include "generated/brick_cells.cl"
#include "generated/brick_sizes.cl"
#define BRICK_ALL 729u  /* points */
#define BRICK_LARGEST 1e30f

typedef struct {
    uint nx, ny, nz, x, y, z; /* of the density; the brick's first point lies one before these */
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

/* Where the points of each brick are, and its highest density. One work-item a brick. */
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

/* The integer that is nearest to 65535 value / most: what division rounds is made good by the remainder. */
inline uint brick_quantum(float value, float most)
{
    if (most <= 0.0f) return 0u;
    float q = rint(value / most * 65535.0f);
    float high = value * 65535.0f, low = fma(value, 65535.0f, -high);
    float rest = fma(-q, most, high) + low;
    q += rest > 0.5f * most ? 1.0f : rest < -0.5f * most ? -1.0f : 0.0f;
    return (uint)clamp(q, 0.0f, 65535.0f);
}

/* Two points a word. One work-item a word. */
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
