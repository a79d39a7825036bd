/* Mixtures: media on a grid that are made of parts. */

/* In a mixture's row, word GRID_MIXED is 1 + the first word of its shares in `images`; it is 0 for other media. The
 * shares are a word for each brick, where its points begin from there, and for each point the density of GRIDS_MIXED
 * parts over the density of the bricks. Behind word GRID_MIXED follow the phase function's word and the coefficients
 * of each part. The mixture's own coefficients times the density of its bricks bound the sum of all parts: they are
 * the majorant. */
inline integer grid_shares(Scene scene, integer name, GridWalk w, mask active, natural bits)
{
    integer first = gather_i(scene.materials, sel_i(active, MEDIUM_ROW(name) + GRID_MIXED, (integer)(0))) - 1;
    active = active & (first >= 0);
    integer brick = (w.z * w.ny + w.y) * w.nx + w.x;
    integer points = first + gather_i(scene.images, sel_i(active, first + brick, (integer)(0)));
    return sel_i(active, points + GRIDS_MIXED * grid_corner(w, bits), (integer)(0));
}

/* A part of a mixture at the point with its shares at word `shares` of `images`, for a density of the bricks of 1.
 * Lanes without shares get any medium. */
inline Medium grid_part(Scene scene, integer name, int part, integer shares, Wavelengths lambdas)
{
    integer row = MEDIUM_ROW(name) + GRID_MIXED + 2 + part * (1 + 2 * MEDIUM_SCATTERING);
    Medium m = medium_load(scene, sel_i(shares != 0, row + 1, (integer)(0)), lambdas);
    real share = gather_w(scene.images, sel_i(shares != 0, shares + part, (integer)(0)));
    m.sigma_s = spectrum_scale(m.sigma_s, share);
    m.sigma_t = spectrum_scale(m.sigma_t, share);
    return m;
}

/* The mixture of all parts at a point. */
inline void grid_mixed(Scene scene, integer name, GridWalk w, mask active, natural bits, Wavelengths lambdas, Medium *m)
{
    integer shares = grid_shares(scene, name, w, active, bits);
    if (any(shares != 0)) {
        Medium whole = grid_part(scene, name, 0, shares, lambdas);
        for (int i = 1; i < GRIDS_MIXED; i++) {
            Medium part = grid_part(scene, name, i, shares, lambdas);
            whole.sigma_s = spectrum_add(whole.sigma_s, part.sigma_s);
            whole.sigma_t = spectrum_add(whole.sigma_t, part.sigma_t);
        }
        m->sigma_s = spectrum_sel(shares != 0, whole.sigma_s, m->sigma_s);
        m->sigma_t = spectrum_sel(shares != 0, whole.sigma_t, m->sigma_t);
    }
}

/* Twin, where no medium is a mixture. */
inline void grid_mixed(Scene scene, integer name, GridWalk w, mask active, natural bits, Wavelengths lambdas, Medium *m)
{
}
