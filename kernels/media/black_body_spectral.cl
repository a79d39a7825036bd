/* Black bodies at the wavelengths of a path. */

/* Planck's law [W m^-2 sr^-1 nm^-1], times `factor`; normalised: 1 at its highest. at: of the grid's words. */
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
