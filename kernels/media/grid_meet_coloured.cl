/* Collisions in grids of one part whose colours differ from point to point. What happens is weighed over a path's
 * wavelengths as distances are, else the choice would leave noise of colour. */

/* A collision where a medium is as dense as `density`: whether it is a real one, by *more, and what it weighs; own: the
 * medium there; passed: see grid_flight. */
inline mask grid_meet(Scene scene, integer name, Medium m, Medium own, GridWalk w, real density, real passed, real most,
                      mask dims, mask meets, natural *more, Wavelengths lambdas, GridFlight *f)
{
    Spectrum scatters = spectrum_scale(own.sigma_s, density);
    Spectrum lacks = spectrum_sub(m.sigma_t, spectrum_scale(own.sigma_t, density));
    Spectrum share = spectrum_div(m.sigma_t, spectrum_add(spectrum_add(scatters, lacks), spectrum_of(1e-30f)));
    Spectrum met = spectrum_mul(f->ratio, grid_passes(m, passed)); /* as likely it comes so far at each wavelength */
    real all = spectrum_mean(spectrum_mul(met, m.sigma_t));
    real chance = spectrum_mean(spectrum_mul(met, spectrum_mul(share, scatters))) / max_r(all, (real)(1e-30f));
    *more = hash_natural(*more ^ 0x2f6e2b1u);
    mask real_one = meets & (unit_interval(*more) < chance);
    Spectrum value = spectrum_sel(real_one, scatters, lacks);
    Spectrum kept = spectrum_sub(spectrum_of(1.0f), spectrum_scale(own.sigma_t, density / most));
    Spectrum pdf = spectrum_sel(dims, spectrum_of(1.0f), spectrum_mul(share, value));
    grid_weigh(m, passed, spectrum_sel(dims, kept, value), pdf, meets, f);
    return real_one;
}
