/* Media with photons: homogeneous media without a dye and with a single phase function. */
#define MERGING_IN_MEDIUM 0x4000 /* added to a photon's group in a medium, so that no photon of a surface is found */

/* The material word of the phase function of a medium with photons; a mixture's word for other media. */
inline integer merging_phase(Scene scene, integer name)
{
    mask even = ((name & MEDIUM_FLIES) != 0) & ((name & (MEDIUM_GRID | MEDIUM_DYED)) == 0);
    integer row = sel_i(even, max_i(MEDIUM_ROW(name), (integer)(1)), (integer)(1));
    return sel_i(even, gather_i(scene.materials, row - 1), (integer)(-1));
}

/* The radius of merging around a ray in a medium of some extinction [m]. Steps along a ray are cylinders inside the
 * sphere of merging_radius, so each lies in eight cells as a disk does. In a dense medium light falls off within a mean
 * free path from the boundary, and a wider cylinder, half of it outside, would find too little light. */
#define MERGING_BESIDE 0.70710678f
#define MERGING_FREE 0.5f /* of the mean free path */
inline real merging_beside(Scene scene, integer pass, Spectrum sigma_t)
{
    real most = MERGING_FREE / max_r(spectrum_mean(sigma_t), (real)(1e-30f));
    return min_r(MERGING_BESIDE * merging_radius(scene, pass), most);
}

/* The cylinder's cross section times the number of light paths, as `merging_area`. */
inline real merging_area_along(Scene scene, integer pass, Spectrum sigma_t)
{
    return PI * scene.settings->photon_paths * sqr(merging_beside(scene, pass, sigma_t));
}

/* A leaf of a mixture: all parts of a phase function are phase functions. */
inline integer merging_part(Scene scene, mask active, integer word)
{
    mask mixed = active & (MATERIAL_KIND(word) == MATERIAL_MIXTURE);
    for (; any(mixed); mixed = active & (MATERIAL_KIND(word) == MATERIAL_MIXTURE))
        word = sel_i(mixed, gather_i(scene.mixtures, sel_i(mixed, MATERIAL_ROW(word), (integer)(0)) + 2), word);
    return word;
}
