/* Which kind of material is to shade the path of a slot, for those who sort slots by it. */
#include "shapes/surface_flags.cl"

/* The kind, or -1. */
inline integer waiting_kind(Slab path, Slab hit, uint at)
{
    mask waits = ((load_path_state(path, at) & PATH_ALIVE) != 0) & (load_hit_prim(hit, at) >= 0);
    return sel_i(waits, MATERIAL_KIND(load_hit_material(hit, at)), (integer)(-1));
}
