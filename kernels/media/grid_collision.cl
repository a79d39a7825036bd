/* Collisions in grids whose colours differ from point to point, and that are no mixtures. Real and null collisions
 * are weighed over a path's wavelengths, as distances are: the choice by the hero wavelength alone leaves noise of
 * colour. */

/* A collision where the density is `density`: *more decides whether it is real or a null collision. The weight of the
 * flight follows. own: the medium there; passed: see grid_flight. Returns the lanes with a real collision. */
inline mask grid_collide(Scene scene, integer name, Medium m, Medium own, GridWalk w, real density, real passed,
                         real most, mask dims, mask meets, natural *more, Wavelengths lambdas, GridFlight *f)
{
    Spectrum scatters = spectrum_scale(own.sigma_s, density);
    Spectrum lacks = spectrum_sub(m.sigma_t, spectrum_scale(own.sigma_t, density));
    Spectrum share = spectrum_div(m.sigma_t, spectrum_add(spectrum_add(scatters, lacks), spectrum_of(1e-30f)));
    Spectrum met = spectrum_mul(f->ratio, grid_passes(m, passed)); /* density at each wavelength */
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

/* Twin, where colours do not differ between points. */
inline mask grid_collide(Scene scene, integer name, Medium m, Medium own, GridWalk w, real density, real passed,
                         real most, mask dims, mask meets, natural *more, Wavelengths lambdas, GridFlight *f)
{
    Spectrum scatters = spectrum_scale(own.sigma_s, density);
    Spectrum lacks = GRIDS_VARY ? spectrum_sub(m.sigma_t, spectrum_scale(own.sigma_t, density))
                                : spectrum_scale(m.sigma_t, 1.0f - density);
    real chance = spectrum_mean(spectrum_mul(f->ratio, spectrum_div(scatters,
        spectrum_add(spectrum_add(scatters, lacks), spectrum_of(1e-30f)))));
    *more = hash_natural(*more ^ 0x2f6e2b1u);
    mask real_one = meets & (unit_interval(*more) < chance);
    chance = 1.0f / max_r(sel(real_one, chance, 1.0f - chance), (real)(1e-30f));
    Spectrum value = spectrum_scale(spectrum_sel(real_one, scatters, lacks), chance);
    Spectrum kept = spectrum_sub(spectrum_of(1.0f), spectrum_scale(own.sigma_t, density / most));
    value = spectrum_sel(dims, kept, value);
    grid_weigh(m, passed, value, spectrum_sel(dims, spectrum_of(1.0f), m.sigma_t), meets, f);
    return real_one;
}
