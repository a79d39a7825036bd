/* All hits of a ray by the compressed tree; returns their number. Each triangle is a single item, so no hit comes
 * twice. */
#include "bvh/compact.cl"
#include "bvh/hit_list.cl"

inline uint compact_all_hits(global const float *nodes, global const float *leaves, HitList list, float ox,
                          float oy, float oz, float dx, float dy, float dz, float tmin, float tmax)
{
    if (!ray_finite(ox, oy, oz, dx, dy, dz)) return 0;
    CompactRay r = compact_ray(ox, oy, oz, dx, dy, dz, tmin);
    Shear shear = shear_make(ox, oy, oz, dx, dy, dz);
    uint2 waiting[COMPACT_STACK], items;
    CompactState state = compact_start(waiting);
    uint found = 0;
    while (compact_next(nodes, &r, tmax, &state, &items)) {
        while (items.y) {
            float t, u, v;
            uint item = compact_item(&items);
            int inside = shear_intersect(&shear, leaves + (ulong)item * 12, 1, &t, &u, &v);
            if (inside && t > tmin && t < tmax) hit_list_put(list, found++, compact_hit(leaves, item, t, u, v));
        }
    }
    return found;
}
