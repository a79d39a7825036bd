/* A part of a mixture that is none itself: all parts of a phase function are phase functions. */
inline integer merging_part(Scene scene, mask active, integer word)
{
    mask mixed = active & (MATERIAL_KIND(word) == MATERIAL_MIXTURE);
    for (; any(mixed); mixed = active & (MATERIAL_KIND(word) == MATERIAL_MIXTURE))
        word = sel_i(mixed, gather_i(scene.mixtures, sel_i(mixed, MATERIAL_ROW(word), (integer)(0)) + 2), word);
    return word;
}
