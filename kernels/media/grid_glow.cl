/* The light of a grid at a point with this temperature, that of a black body; `light` for grids without
 * temperatures. at: the grid's words. */
inline Spectrum grid_glow(Scene scene, integer at, real number, mask active, Wavelengths lambdas, Spectrum light)
{
    integer kind = gather_i(scene.materials, at + 1);
    mask glows = active & (kind != 0);
    if (any(glows)) {
        light = spectrum_sel(glows, grid_black_body(scene, at, number, kind == 2, glows, lambdas), light);
    }
    return light;
}

/* Twin, where no grid has a temperature. */
inline Spectrum grid_glow(Scene scene, integer at, real number, mask active, Wavelengths lambdas, Spectrum light)
{
    return light;
}
