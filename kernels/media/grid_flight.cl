/* Flights through a medium on a grid, by delta tracking (Woodcock 1965); null collisions are weighed over the path's
 * wavelengths as all else is (Miller, Georgiev and Jarosz 2019).
 *
 * Where some grids emit, a flight gathers light at one point of each way that it goes without a collision within a
 * brick: chosen evenly, and weighed as if the flight had come just there. Light is also sought by next-event estimation
 * (light/emissive_brick.cl), and both are weighed. */
/* Where a flight ends, and what its sample weighs; `ratio` as in path/hero.cl. */
typedef struct {
    mask collides;
    real t; /* [m] */
    Spectrum weight, ratio;
    Spectrum light; /* that it gathers, where some grids emit */
    integer phase;  /* material word of the part that it collides with */
} GridFlight;

/* How a flight's direction was chosen: see Path.pdf, and from where. It matters where some grids emit. */
typedef struct {
    real pdf, before; /* [1/sr]; [m] from there to the flight's origin */
    vec3 from, hemisphere;
} GridOrigin;

/* After so much of the highest density, times metres, since the last collision the path is as likely as `pdf` at each
 * wavelength, and `value` of light is left; both lack what passes at the least extinction. */
inline void grid_weigh(Medium m, real thickness, Spectrum value, Spectrum pdf, mask active, GridFlight *f)
{
#if USES_RATIO
    real least = min_r(min_r(m.sigma_t.x, m.sigma_t.y), m.sigma_t.z);
#if SPECTRUM_SIZE == 4
    least = min_r(least, m.sigma_t.w);
#endif
    Spectrum passes = spectrum_exp(spectrum_scale(spectrum_sub(m.sigma_t, spectrum_of(least)), -thickness));
    Spectrum pdfs = spectrum_mul(f->ratio, spectrum_mul(pdf, passes));
    real mean = spectrum_mean(pdfs), inverse = sel(mean > 1e-30f, 1.0f / mean, (real)(0.0f));
    Spectrum weight = spectrum_scale(spectrum_mul(value, passes), inverse);
    f->ratio = spectrum_sel(active, spectrum_scale(pdfs, inverse), f->ratio);
#else
    Spectrum weight = spectrum_scale(value, 1.0f / max_r(pdf.x, (real)(1e-30f)));
#endif
    f->weight = spectrum_sel(active, spectrum_mul(f->weight, weight), f->weight);
}

#if GRIDS_EMIT
/* Adds what a brick emits along the way from w.t to `to`, the flight having come through `passed` before. */
inline void grid_gather(Scene scene, integer name, Medium m, GridWalk w, GridBrick b, real to, real passed, mask dims,
                        natural bits, mask active, GridFlight *f, Wavelengths lambdas, GridOrigin origin)
{
    integer row = grid_light_row(scene, name, w, active);
    active = active & (row != 0) & (to > w.t);
    if (!any(active)) return;
    real way = to - w.t, part = unit_interval(hash_natural(bits ^ 0x3c6ef372u)) * way;
    w.t = sel(active, w.t + part, w.t);
    Spectrum light = grid_emission(scene, name, m, w, b, active, hash_natural(bits ^ 0xdaa66d2bu), lambdas);
    GridFlight here = *f;
    grid_weigh(m, passed + sel(dims, (real)(0.0f), b.most * part), spectrum_of(1.0f), spectrum_of(1.0f), active, &here);
    real w_met = 1.0f;
#if BRICK_LIGHTS
    mask sought = active & (row > 0) & (origin.pdf >= 0.0f);
    if (any(sought)) {
        integer one = sel_i(sought, row - 1, (integer)(0));
        real pdf = brick_light_pdf(scene, one, origin.from, origin.hemisphere, origin.before + w.t);
        w_met = sel(sought, mis_weight(origin.pdf, pdf), w_met);
    }
#endif
    light = spectrum_scale(spectrum_mul(here.weight, light), way * w_met);
    f->light = spectrum_sel(active, spectrum_add(f->light, light), f->light);
}
#endif

#if GRIDS_MIXED
/* The part of a mixture with which light collides where `bits` choose: its phase function, and what it scatters where
 * the density of the bricks is 1. Each has its chance by how much it scatters of the hero wavelength, which `ratio` and
 * `hero` choose. Other media are of one part. */
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
        /* What is left of u is as good as new. */
        u = sel(taken, u / max_r(chance, (real)(1e-30f)), (u - chance) / rest);
        u = clamp_r(u, (real)(0.0f), (real)(0.99999994f));
        m.sigma_s = spectrum_sel(taken, part.sigma_s, m.sigma_s);
        m.phase = sel_i(taken, part.phase, m.phase);
    }
    return m;
}
#endif

/* A collision where a medium is as dense as `density`: whether it is a real one, by *more, and what it weighs; own: the
 * medium there; passed: see grid_flight. */
inline mask grid_meet(Scene scene, integer name, Medium m, Medium own, GridWalk w, real density, real passed, real most,
                      mask dims, mask meets, natural *more, Wavelengths lambdas, GridFlight *f)
{
    Spectrum scatters = spectrum_scale(own.sigma_s, density);
#if GRIDS_VARY
    Spectrum lacks = spectrum_sub(m.sigma_t, spectrum_scale(own.sigma_t, density));
#else
    Spectrum lacks = spectrum_scale(m.sigma_t, 1.0f - density);
#endif
#if GRIDS_MIXED
    /* What happens is chosen by the hero wavelength, and weighed over all as distances are. */
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
#else
    real chance = spectrum_mean(spectrum_mul(f->ratio, spectrum_div(scatters,
        spectrum_add(spectrum_add(scatters, lacks), spectrum_of(1e-30f)))));
    *more = hash_natural(*more ^ 0x2f6e2b1u);
    mask real_one = meets & (unit_interval(*more) < chance);
    chance = 1.0f / max_r(sel(real_one, chance, 1.0f - chance), (real)(1e-30f));
    Spectrum value = spectrum_scale(spectrum_sel(real_one, scatters, lacks), chance);
    Spectrum kept = spectrum_sub(spectrum_of(1.0f), spectrum_scale(own.sigma_t, density / most));
    value = spectrum_sel(dims, kept, value);
    grid_weigh(m, passed, value, spectrum_sel(dims, spectrum_of(1.0f), m.sigma_t), meets, f);
#endif
    return real_one;
}

/* A flight from o along d through the medium `name`, at most t metres; u: of its first way. */
inline GridFlight grid_flight(Scene scene, integer name, Medium m, vec3 o, vec3 d, real t, Spectrum ratio, vec2 u,
                              natural key, mask active, Wavelengths lambdas, GridOrigin origin)
{
    GridFlight f = {mask_of(0), t, spectrum_of(1.0f), ratio, spectrum_of(0.0f), m.phase};
#if GRIDS_EMIT
    natural ways = 0u;
#endif
    GridWalk w;
    mask all = active;
    active = grid_begin(scene, name, o, d, t, active, &w);
    mask dims = spectrum_max(m.sigma_s) == 0.0f; /* and never scatters: then all wavelengths share the collisions */
    real most = max_r(spectrum_max(m.sigma_t), (real)(1e-30f)), passed = 0.0f;
    real sigma = sel(dims, most, max_r(spectrum_pick(m.sigma_t, ratio, u.y), (real)(1e-30f)));
    real left = -log_r(max_r(1.0f - u.x, (real)(1e-9f))) / sigma;
    natural count = 0u;
    while (any(active)) {
        GridBrick b = grid_brick(scene, w, active);
        real thick = b.most * (b.exit - w.t);
        mask meets = active & (thick > left);
#if GRIDS_EMIT
        real to = sel(meets, min_r(w.t + left / max_r(b.most, (real)(1e-30f)), b.exit), b.exit);
        natural gathers = hash_natural(key ^ (0x9b05688cu + ways * 0x85ebca6bu));
        grid_gather(scene, name, m, w, b, to, passed, dims, gathers, active, &f, lambdas, origin);
        ways++;
#endif
        passed += sel(active & !dims, sel(meets, left, thick), (real)(0.0f));
        w.t = sel(active, sel(meets, min_r(w.t + left / max_r(b.most, (real)(1e-30f)), b.exit), b.exit), w.t);
        left -= sel(active, thick, (real)(0.0f));
        if (any(meets)) {
            natural bits = hash_natural(key + count * 0x9e3779b9u), more = hash_natural(bits ^ 0x68bc21ebu);
            real density = brick_density(scene, w, b, meets, more);
            Medium own = grid_medium(scene, name, m, w, meets, more, lambdas);
            mask real_one = grid_meet(scene, name, m, own, w, density, passed, most, dims, meets, &more, lambdas, &f);
            f.collides = f.collides | real_one;
            f.t = sel(real_one, w.t, f.t);
            passed = sel(meets, (real)(0.0f), passed);
            active = active & !real_one & (spectrum_max(f.weight) > 0.0f);
            real pick = 0.0f;
#if USES_RATIO
            pick = unit_interval(hash_natural(more ^ 0x51ed270bu));
#endif
            sigma = sel(dims, most, max_r(spectrum_pick(m.sigma_t, f.ratio, pick), (real)(1e-30f)));
            left = sel(meets, grid_length(bits) / sigma, left);
            count += sel_n(meets, (natural)(1u), (natural)(0u));
        }
        active = sel_i(meets, active, grid_next(&w, b, active & !meets));
    }
#if USES_RATIO
    grid_weigh(m, passed, spectrum_of(1.0f), spectrum_of(1.0f), all & !f.collides, &f);
#endif
    return f;
}
