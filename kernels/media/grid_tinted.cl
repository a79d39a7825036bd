/* Scattering with albedos on a grid. */
inline void grid_tinted(Scene scene, integer name, GridWalk w, mask active, natural bits, Wavelengths lambdas,
                          Medium *m)
{
    m->sigma_s = spectrum_mul(m->sigma_s, grid_tint(scene, name, GRID_ALBEDO, w, active, bits, lambdas));
}

/* Twin, where no albedo is on a grid. */
inline void grid_tinted(Scene scene, integer name, GridWalk w, mask active, natural bits, Wavelengths lambdas,
                          Medium *m) {}
