/* Numbers in a row of a kind's parameters; spectra are read in spectrum/<mode>_read.cl, textures in
 * the generated dispatch. */
inline real real_constant(global const uint *table, integer at, Wavelengths lambdas)
{
    return gather_w(table, at);
}
