/* Emission that flights gather in grids. */
#include "generated/brick_weight.cl"

/* Adds the emission of a brick from w.t to `to`; passed: see grid_flight. */
inline void grid_gather(Scene scene, integer name, Medium m, GridWalk w, GridBrick b, real to, real passed, mask dims,
                        natural bits, mask active, GridFlight *f, Wavelengths lambdas, GridOrigin origin)
{
    integer row = grid_light_row(scene, name, w, active);
    active = active & (row != 0) & (to > w.t);
    if (!any(active)) return;
    real way = to - w.t, part = unit_interval(hash_natural(bits ^ 0x3c6ef372u)) * way;
    w.t = sel(active, w.t + part, w.t);
    Spectrum light = grid_emission(scene, name, m, w, b, active, hash_natural(bits ^ 0xdaa66d2bu), lambdas);
    GridFlight here = *f;
    grid_weigh(m, passed + sel(dims, (real)(0.0f), b.most * part), spectrum_of(1.0f), spectrum_of(1.0f), active, &here);
    real w_met = brick_weight(scene, row, active, origin, w.t);
    light = spectrum_scale(spectrum_mul(here.weight, light), way * w_met);
    f->light = spectrum_sel(active, spectrum_add(f->light, light), f->light);
}

/* Twin, where no grid emits. */
inline void grid_gather(Scene scene, integer name, Medium m, GridWalk w, GridBrick b, real to, real passed, mask dims,
                        natural bits, mask active, GridFlight *f, Wavelengths lambdas, GridOrigin origin) {}
