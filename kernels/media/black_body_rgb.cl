/* Black bodies by a table of their colours. */

/* Planck's law [W m^-2 sr^-1 nm^-1], times `factor`; normalised: 1 at its highest. at: of the grid's words. */
inline Spectrum grid_black_body(Scene scene, integer at, real kelvin, mask normalised, mask active, Wavelengths lambdas)
{
    real factor = gather_w(scene.materials, at + 3);
    mask hot = active & (kelvin > 1.0f);
    kelvin = sel(hot, kelvin, (real)(1.0f));
    real place = kelvin * gather_w(scene.materials, at + 5);
    integer cell = clamp_i(to_integer(place), (integer)(1022));
    real share = clamp_r(place - to_real(cell), (real)(0.0f), (real)(1.0f));
    integer first = sel_i(hot, gather_i(scene.materials, at + 4) + 3 * cell, (integer)(0));
    Spectrum r;
#define C(c, i)                                                             \
    real low_##c = gather(scene.distributions, first + i);                  \
    r.c = sel(hot, low_##c + share * (gather(scene.distributions, first + 3 + i) - low_##c), (real)(0.0f));
    C(x, 0)
    C(y, 1)
    C(z, 2)
#undef C
    return r;
}
