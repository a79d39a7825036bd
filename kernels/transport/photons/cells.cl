/* The cells of a hash grid with `photon_cells` numbers. A cell's side is the diameter of the merging disk, so a disk
 * lies in eight cells at most, two along each axis. The lowest bits of a cell's coordinates are the lowest bits of its
 * number: neighbours have different numbers, and no photon is found twice. */
typedef struct { integer x, y, z; } Cell;

inline Cell cell_at(Scene scene, vec3 p, real side)
{
    global const float *center = scene.settings->center;
    Cell c;
    c.x = to_integer(floor((p.x - center[0]) / side));
    c.y = to_integer(floor((p.y - center[1]) / side));
    c.z = to_integer(floor((p.z - center[2]) / side));
    return c;
}

inline integer cell_number(Scene scene, Cell c, integer group)
{
    natural x = as_natural(c.x), y = as_natural(c.y), z = as_natural(c.z);
    natural far = hash_natural((x >> 1u) + hash_natural((y >> 1u) + hash_natural((z >> 1u) + as_natural(group))));
    natural near = (x & 1u) | (y & 1u) << 1u | (z & 1u) << 2u;
    return as_integer((far << 3u | near) & (natural)(scene.settings->photon_cells - 1));
}
