/* Which media have photons: those that are the same everywhere, without a dye, and with one phase function. */
#define MERGING_IN_MEDIUM 0x4000 /* joins the group of a photon there, so that none of a surface is found */

/* The material word of the phase function of such a medium; of others that of a mixture, which no medium has there. */
inline integer merging_phase(Scene scene, integer name)
{
    mask even = ((name & MEDIUM_FLIES) != 0) & ((name & (MEDIUM_GRID | MEDIUM_DYED)) == 0);
    integer row = sel_i(even, max_i(MEDIUM_ROW(name), (integer)(1)), (integer)(1));
    return sel_i(even, gather_i(scene.materials, row - 1), (integer)(-1));
}

/* A part of a mixture that is none itself: all parts of a phase function are phase functions. */
inline integer merging_part(Scene scene, mask active, integer word)
{
    mask mixed = active & (MATERIAL_KIND(word) == MATERIAL_MIXTURE);
    for (; any(mixed); mixed = active & (MATERIAL_KIND(word) == MATERIAL_MIXTURE))
        word = sel_i(mixed, gather_i(scene.mixtures, sel_i(mixed, MATERIAL_ROW(word), (integer)(0)) + 2), word);
    return word;
}
