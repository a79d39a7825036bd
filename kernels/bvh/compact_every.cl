/* Every hit of a ray by the compressed tree; their number is returned. A triangle is one item only, so that
 * none is met twice. */
#include "bvh/compact.cl"
#include "bvh/every.cl"

inline uint compact_every(global const float *nodes, global const float *leaves, Every every, float ox,
                          float oy, float oz, float dx, float dy, float dz, float tmin, float tmax)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return 0;
    CompactRay r = compact_ray(ox, oy, oz, dx, dy, dz, tmin);
    Shear shear = shear_make(ox, oy, oz, dx, dy, dz);
    CompactWay way;
    uint2 items;
    uint found = 0;
    compact_begin(&way);
    while (compact_next(nodes, &r, tmax, &way, &items)) {
        while (items.y) {
            float t, u, v;
            uint item = compact_item(&items);
            int inside = shear_intersect(&shear, leaves + (ulong)item * 12, 1, &t, &u, &v);
            if (inside && t > tmin && t < tmax) every_put(every, found++, compact_hit(leaves, item, t, u, v));
        }
    }
    return found;
}
