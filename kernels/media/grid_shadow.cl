/* Shadow rays through media on grids. */

/* The key of the random numbers of a shadow ray. */
inline natural grid_shadow_key(Scene scene, Slab path, uint at)
{
    integer vertex = (load_path_state(path, at) & PATH_DEPTH) + load_path_nulls(path, at);
    return ~grid_key(scene, load_path_pixel_key(path, at), load_path_sample(path, at), vertex);
}

/* The transmittance of a shadow ray through a medium on a grid; for other media the argument. */
inline Spectrum grid_shadow_transmittance(Scene scene, integer medium, vec3 o, vec3 d, real way, natural key,
                                          mask active, Wavelengths lambdas, Spectrum transmittance)
{
    mask gridded = active & ((medium & MEDIUM_GRID) != 0);
    if (any(gridded)) {
        Medium m = medium_load(scene, sel_i(gridded, medium, (integer)(0)), lambdas);
        Spectrum passed = grid_transmittance(scene, medium, m, o, d, way, key, gridded, lambdas);
        transmittance = spectrum_sel(gridded, passed, transmittance);
    }
    return transmittance;
}

/* Twin, where no medium is on a grid. */
inline natural grid_shadow_key(Scene scene, Slab path, uint at) { return ((natural)(0u)); }
inline Spectrum grid_shadow_transmittance(Scene scene, integer medium, vec3 o, vec3 d, real way, natural key,
                                          mask active, Wavelengths lambdas, Spectrum transmittance)
{
    return transmittance;
}
