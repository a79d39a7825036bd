/* What of a ray to a light passes grids on its way. */

/* Of the random numbers that it has there. */
inline natural grid_way_key(Scene scene, Slab path, uint at)
{
    integer vertex = (load_path_state(path, at) & PATH_DEPTH) + load_path_nulls(path, at);
    return ~grid_key(scene, load_path_pixel_key(path, at), load_path_sample(path, at), vertex);
}

/* `dims`, or where a grid is, what passes it. */
inline Spectrum grid_way(Scene scene, integer medium, vec3 o, vec3 d, real way, natural key, mask active,
                         Wavelengths lambdas, Spectrum dims)
{
    mask gridded = active & ((medium & MEDIUM_GRID) != 0);
    if (any(gridded)) {
        Medium m = medium_load(scene, sel_i(gridded, medium, (integer)(0)), lambdas);
        Spectrum passed = grid_transmittance(scene, medium, m, o, d, way, key, gridded, lambdas);
        dims = spectrum_sel(gridded, passed, dims);
    }
    return dims;
}

/* Twin, where there are no grids. */
#define grid_way_key(scene, path, at) ((natural)(0u))
#define grid_way(scene, medium, o, d, way, key, active, lambdas, dims) (dims)
