/* Collisions in grids of one part. */

/* A collision where a medium is as dense as `density`: whether it is a real one, by *more, and what it weighs; own: the
 * medium there; passed: see grid_flight. */
inline mask grid_meet(Scene scene, integer name, Medium m, Medium own, GridWalk w, real density, real passed, real most,
                      mask dims, mask meets, natural *more, Wavelengths lambdas, GridFlight *f)
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

