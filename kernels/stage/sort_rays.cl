/* Queue 0 of all slots in a coarse order of their rays, for `intersect`. RAY_WINDOW neighbouring slots at a time are
 * sorted by the octant of the direction, then by the cell of the origin: so few that their state stays in a cache. It
 * is a counting sort, whose groups of work-items count in local memory. The order does not matter to the picture. */
#include "core/base.cl"
#include "generated/ray_order.cl"

/* The cell along an axis of a cube with its corners on the sphere around the scene; the outer cells have all beyond. */
inline uint ray_cell(float from_center, float radius)
{
    return clamp((int)((from_center * 1.7320508f / radius + 1.0f) * (0.5f * RAY_CELLS)), 0, RAY_CELLS - 1);
}

/* The key of a slot. A slot without a ray has the last key; a number beyond the slots has RAY_KEYS. */
inline uint ray_key(Slab path, global const Settings *settings, uint slot, uint slots)
{
    if (slot >= slots) return RAY_KEYS;
    if (!(load_path_state(path, slot) & PATH_ALIVE)) return RAY_KEYS - 1;
    vec3 o = load_path_o(path, slot), d = load_path_d(path, slot);
    uint key = (d.x > 0.0f) << 2 | (d.y > 0.0f) << 1 | (d.z > 0.0f);
    key = key * RAY_CELLS + ray_cell(o.x - settings->center[0], settings->scene_radius);
    key = key * RAY_CELLS + ray_cell(o.y - settings->center[1], settings->scene_radius);
    return key * RAY_CELLS + ray_cell(o.z - settings->center[2], settings->scene_radius);
}

/* Counts the keys of a group in `tally`; returns how many work-items were before this one at its key. */
inline uint ray_rank(local uint *tally, uint key)
{
    uint rank = 0;
    for (uint k = get_local_id(0); k < RAY_KEYS; k += get_local_size(0)) tally[k] = 0;
    barrier(CLK_LOCAL_MEM_FENCE);
    if (key < RAY_KEYS) rank = atomic_inc(tally + key);
    barrier(CLK_LOCAL_MEM_FENCE);
    return rank;
}

/* No rays; a work-item for each key of each window, as in rays_sum. */
kernel void rays_begin(global uint *ray_counts) { ray_counts[get_global_id(0)] = 0; }

/* The rays of each key. */
kernel void rays_count(SLAB_ARGS, global const Settings *settings, global uint *ray_counts, uint slots)
{
    SLABS
    local uint tally[RAY_KEYS];
    uint slot = get_global_id(0);
    ray_rank(tally, ray_key(path, settings, slot, slots));
    for (uint k = get_local_id(0); k < RAY_KEYS; k += get_local_size(0))
        if (tally[k]) atomic_add(ray_counts + slot / RAY_WINDOW * RAY_KEYS + k, tally[k]);
}

/* Where the rays of each key begin in the queue, which has all slots. */
kernel void rays_sum(global const uint *ray_counts, global uint *ray_starts, global uint *queue_counts, uint slots)
{
    uint at = get_global_id(0), sum = at / RAY_KEYS * RAY_WINDOW;
    for (uint k = at / RAY_KEYS * RAY_KEYS; k < at; k++) sum += ray_counts[k];
    ray_starts[at] = sum;
    if (at == 0) queue_counts[0] = slots;
}

/* Places the slots in the queue; `ray_starts` advances from the first ray of each key to the end. */
kernel void rays_place(SLAB_ARGS, global const Settings *settings, global uint *ray_starts, global uint *queue,
                       uint slots)
{
    SLABS
    local uint tally[RAY_KEYS];
    uint slot = get_global_id(0), key = ray_key(path, settings, slot, slots), rank = ray_rank(tally, key);
    for (uint k = get_local_id(0); k < RAY_KEYS; k += get_local_size(0))
        if (tally[k]) tally[k] = atomic_add(ray_starts + slot / RAY_WINDOW * RAY_KEYS + k, tally[k]);
    barrier(CLK_LOCAL_MEM_FENCE);
    if (key < RAY_KEYS) queue[tally[key] + rank] = slot;
}
