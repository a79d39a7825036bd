/* Planck's law [W m^-2 sr^-1 nm^-1] times a factor, at the wavelengths of a path. normalised: the largest value is
 * 1. at: the grid's words, see media/medium_grid_light.cl. */
inline Spectrum grid_black_body(Scene scene, integer at, real kelvin, mask normalised, mask active, Wavelengths lambdas)
{
    real factor = gather_w(scene.materials, at + 3);
    mask hot = active & (kelvin > 1.0f);
    kelvin = sel(hot, kelvin, (real)(1.0f));
    real t2 = kelvin * kelvin, top = 4.0956747e-15f * t2 * t2 * kelvin;
    factor *= sel(normalised, 1.0f / top, (real)(1.0f));
    Spectrum r;
#define C(c)                                                                                        \
    real nm_##c = lambdas.c, m2_##c = nm_##c * nm_##c;                                              \
    real less_##c = exp_r(-min_r(1.438776877e7f / (nm_##c * kelvin), (real)(80.0f)));               \
    r.c = sel(hot, factor * 1.191042972e20f / (m2_##c * m2_##c * nm_##c) * less_##c / (1.0f - less_##c), (real)(0.0f));
    SPECTRUM_EACH(C)
#undef C
    return r;
}

/* Twin, in RGB mode: from a table of colours. */
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
