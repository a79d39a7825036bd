/* Which kind of material is to shade the path of a slot, for the stages that sort slots by it. */
#include "path/surface_flags.cl"

/* The kind, or -1. */
inline int waiting_kind(Slab path, Slab hit, uint slot)
{
    int alive = (load_path_state(path, slot) & PATH_ALIVE) != 0 && load_hit_prim(hit, slot) >= 0;
    return alive ? MATERIAL_KIND(load_hit_material(hit, slot)) : -1;
}
