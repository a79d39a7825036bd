/* Which media have photons: those that are the same everywhere, without a dye, and with one phase function. */
#define MERGING_IN_MEDIUM 0x4000 /* joins the group of a photon there, so that none of a surface is found */

/* The material word of the phase function of such a medium; of others that of a mixture, which no medium has there. */
inline integer merging_phase(Scene scene, integer name)
{
    mask even = ((name & MEDIUM_FLIES) != 0) & ((name & (MEDIUM_GRID | MEDIUM_DYED)) == 0);
    integer row = sel_i(even, max_i(MEDIUM_ROW(name), (integer)(1)), (integer)(1));
    return sel_i(even, gather_i(scene.materials, row - 1), (integer)(-1));
}

/* How far from a ray photons are merged in a medium of such an extinction [m]. Steps along a ray are cylinders inside
 * the sphere of merging_radius, so that each lies in eight cells as a disk does. Where a body scatters much its light
 * falls within a mean free path from the boundary, and a wider cylinder, half of it outside, would see too little. */
#define MERGING_BESIDE 0.70710678f
#define MERGING_FREE 0.5f /* of the mean free path */
inline real merging_beside(Scene scene, integer pass, Spectrum sigma_t)
{
    real most = MERGING_FREE / max_r(spectrum_mean(sigma_t), (real)(1e-30f));
    return min_r(MERGING_BESIDE * merging_radius(scene, pass), most);
}

/* Its section, as `merging_area`. */
inline real merging_area_along(Scene scene, integer pass, Spectrum sigma_t)
{
    return PI * scene.settings->photon_paths * sqr(merging_beside(scene, pass, sigma_t));
}
