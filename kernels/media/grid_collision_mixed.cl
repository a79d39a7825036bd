/* Collisions in mixtures. */

/* The part of a mixture with which light collides at the point that `bits` choose: its phase function, and its
 * scattering where the density of the bricks is 1. The probability of a part is its share of the scattering at the
 * hero wavelength, which `ratio` and `hero` choose. Other media are returned unchanged. */
inline Medium grid_part_met(Scene scene, integer name, Medium m, GridWalk w, natural bits, Spectrum ratio, real hero,
                            mask active, Wavelengths lambdas)
{
    integer shares = grid_shares(scene, name, w, active, bits);
    real sum = 0.0f, u = unit_interval(hash_natural(bits ^ 0x3c6ef372u));
    for (int i = 0; any(shares != 0) && i < GRIDS_MIXED; i++) {
        Medium part = grid_part(scene, name, i, shares, lambdas);
        real own = spectrum_pick(part.sigma_s, ratio, hero);
        sum += own;
        real chance = own / max_r(sum, (real)(1e-30f)), rest = max_r(1.0f - chance, (real)(1e-30f));
        mask taken = (shares != 0) & (u < chance);
        /* u is rescaled to a new random number. */
        u = sel(taken, u / max_r(chance, (real)(1e-30f)), (u - chance) / rest);
        u = clamp_r(u, (real)(0.0f), (real)(0.99999994f));
        m.sigma_s = spectrum_sel(taken, part.sigma_s, m.sigma_s);
        m.phase = sel_i(taken, part.phase, m.phase);
    }
    return m;
}

/* A collision where the density is `density`: *more decides whether it is real or a null collision. The weight of the
 * flight follows. own: the medium there; passed: see grid_flight. Returns the lanes with a real collision. */
inline mask grid_collide(Scene scene, integer name, Medium m, Medium own, GridWalk w, real density, real passed,
                         real most, mask dims, mask meets, natural *more, Wavelengths lambdas, GridFlight *f)
{
    Spectrum scatters = spectrum_scale(own.sigma_s, density);
    Spectrum lacks = GRIDS_VARY ? spectrum_sub(m.sigma_t, spectrum_scale(own.sigma_t, density))
                                : spectrum_scale(m.sigma_t, 1.0f - density);
    /* The hero wavelength chooses the event; it is weighed over all wavelengths, as distances are. */
    grid_weigh(m, passed, spectrum_of(1.0f), spectrum_sel(dims, spectrum_of(1.0f), m.sigma_t), meets, f);
    Spectrum whole = spectrum_add(spectrum_add(scatters, lacks), spectrum_of(1e-30f));
    real hero = unit_interval(hash_natural(*more ^ 0x1b873593u));
    real chance = spectrum_pick(spectrum_div(scatters, whole), f->ratio, hero);
    natural corner = *more;
    *more = hash_natural(*more ^ 0x2f6e2b1u);
    mask real_one = meets & (unit_interval(*more) < chance);
    Medium part = grid_part_met(scene, name, own, w, corner, f->ratio, hero, real_one, lambdas);
    f->phase = sel_i(real_one, part.phase, f->phase);
    Spectrum value = spectrum_sel(real_one, spectrum_scale(part.sigma_s, density), lacks);
    Spectrum kept = spectrum_sub(spectrum_of(1.0f), spectrum_scale(own.sigma_t, density / most));
    Spectrum pdf = spectrum_sel(dims, spectrum_of(1.0f), spectrum_div(value, whole));
    grid_weigh(m, (real)(0.0f), spectrum_sel(dims, kept, value), pdf, meets, f);
    return real_one;
}
