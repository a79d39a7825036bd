/* Extinction with colours on a grid. */
inline void grid_coloured(Scene scene, integer name, GridWalk w, mask active, natural bits, Wavelengths lambdas,
                           Medium *m)
{
    Spectrum colour = grid_tint(scene, name, GRID_COLOUR, w, active, bits, lambdas);
    m->sigma_s = spectrum_mul(m->sigma_s, colour);
    m->sigma_t = spectrum_mul(m->sigma_t, colour);
}

/* Twin, where extinction has no colours on a grid. */
inline void grid_coloured(Scene scene, integer name, GridWalk w, mask active, natural bits, Wavelengths lambdas,
                           Medium *m) {}
