/* Light paths that collide in media leave what they carry in rows beside those of surfaces. */
#include "generated/medium.cl"
#include "generated/phases.cl"
#include "transport/photons/part.cl"
#include "transport/guiding/collision_row.cl"

#define GUIDE_THIN 0.0625f /* 4 sigma_s times a cell's side, between which it counts: beyond, whole numbers would not */
#define GUIDE_DENSE 4.0f   /* tell what paths carry */

/* The row of a light path, which is `row` on a surface. shared: by what its light is divided, so that Russian roulette
 * may compare both: of even light, what collides in a cell is 4 sigma_s times its side of what falls on a side. */
inline integer collision_row(Scene scene, Slab path, Slab hit, uint at, mask active, integer row, real *shared)
{
    integer part = merging_part(scene, active, load_hit_material(hit, at));
    mask collides = active & is_phase(MATERIAL_KIND(part));
    if (!any(collides)) return row;
    integer name = sel_i(collides, load_path_medium(path, at), (integer)(0));
    real sigma = spectrum_mean(medium_load(scene, name, load_path_lambdas(path, at)).sigma_s);
    real counts = clamp_r(4.0f * sigma * scene.settings->guide_side, (real)(GUIDE_THIN), (real)(GUIDE_DENSE));
    *shared = sel(collides, counts, *shared);
    vec3 p = madd3(load_path_d(path, at), load_hit_t(hit, at), load_path_o(path, at));
    return sel_i(collides, guide_row_of_collision(scene, p), row);
}

/* Twin, where there are no media. */
inline integer collision_row(Scene scene, Slab path, Slab hit, uint at, mask active, integer row, real *shared)
{
    return row;
}
