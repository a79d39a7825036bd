/* Flights through a medium on a grid, by delta tracking (Woodcock 1965); null collisions are weighed over the path's
 * wavelengths, as other events are (Miller, Georgiev and Jarosz 2019).
 *
 * Where some grids emit, a flight gathers emission at a random point of each segment between collisions and brick
 * boundaries: the point is uniform, and weighed by the transmittance to it. Next-event estimation samples the same
 * light (lights/kinds/emissive_brick.cl); MIS combines both. */

/* Step. */
/* The end of a flight, and its weight; `ratio` as in spectra/hero.cl. */
typedef struct {
    mask collides, endless; /* endless: after MOST_NULL_COLLISIONS its weight is 0 */
    real t;                 /* [m] */
    Spectrum weight, ratio;
    Spectrum light; /* gathered emission, where some grids emit */
    integer phase;  /* material word of the colliding part's phase function */
} GridFlight;

#include "generated/flight_steps_of_grids.cl"

/* The same medium. Compilers do not know that a walk is always below nx: what follows from the coefficients is computed
 * in each turn of a loop, and not kept in registers. */
inline Medium grid_medium_again(Medium m, GridWalk w)
{
    mask below = w.x < w.nx;
    m.sigma_t = spectrum_sel(below, m.sigma_t, spectrum_of(0.0f));
    m.sigma_s = spectrum_sel(below, m.sigma_s, spectrum_of(0.0f));
    return m;
}

/* A flight from o along d through the medium `name`, at most t metres; u: random numbers of its first segment. */
inline GridFlight grid_flight(Scene scene, integer name, Medium m, vec3 o, vec3 d, real t, Spectrum ratio, vec2 u,
                              natural key, mask active, Wavelengths lambdas, Slab path, uint at)
{
    GridFlight f = {mask_of(0), mask_of(0), t, spectrum_of(1.0f), ratio, spectrum_of(0.0f), m.phase};
    natural ways = 0u;
    GridWalk w;
    mask all = active;
    active = grid_begin(scene, name, o, d, t, active, &w);
    mask dims = spectrum_max(m.sigma_s) == 0.0f; /* without scattering all wavelengths share the collisions */
    real most = max_r(spectrum_max(m.sigma_t), (real)(1e-30f)), passed = 0.0f;
    real sigma = sel(dims, most, max_r(spectrum_pick(m.sigma_t, ratio, u.y), (real)(1e-30f)));
    real left = -log_r(max_r(1.0f - u.x, (real)(1e-9f))) / sigma;
    natural count = 0u;
    while (any(active)) {
        if (LANES == 1) m = grid_medium_again(m, w);
        GridBrick b = grid_brick(scene, w, active);
        real thick = b.most * (b.exit - w.t);
        mask meets = active & (thick > left);
        real to = sel(meets, min_r(w.t + left / max_r(b.most, (real)(1e-30f)), b.exit), b.exit);
        natural gathers = hash_natural(key ^ (0x9b05688cu + ways * 0x85ebca6bu));
        grid_gather(scene, name, m, w, b, to, passed, dims, gathers, active, &f, lambdas, path, at);
        ways++;
        passed += sel(active & !dims, sel(meets, left, thick), (real)(0.0f));
        w.t = sel(active, sel(meets, min_r(w.t + left / max_r(b.most, (real)(1e-30f)), b.exit), b.exit), w.t);
        left -= sel(active, thick, (real)(0.0f));
        if (any(meets)) {
            natural bits = hash_natural(key + count * 0x9e3779b9u), more = hash_natural(bits ^ 0x68bc21ebu);
            real density = brick_density(scene, w, b, meets, more);
            Medium own = grid_medium(scene, name, m, w, meets, more, lambdas);
            mask real_one = grid_collide(scene, name, m, own, w, density, passed, most, dims, meets, &more, lambdas,
                                         &f);
            f.collides = f.collides | real_one;
            f.t = sel(real_one, w.t, f.t);
            passed = sel(meets, (real)(0.0f), passed);
            active = active & !real_one & (spectrum_max(f.weight) > 0.0f);
            sigma = sel(dims, most, max_r(spectrum_pick(m.sigma_t, f.ratio, grid_hero(more)), (real)(1e-30f)));
            left = sel(meets, grid_length(bits) / sigma, left);
            count += sel_n(meets, (natural)(1u), (natural)(0u));
            f.endless = f.endless | (active & (count >= MOST_NULL_COLLISIONS));
            active = active & !f.endless;
        }
        active = sel_i(meets, active, grid_next(&w, b, active & !meets));
    }
    grid_weigh_end(m, passed, all & !f.collides, &f);
    f.weight = spectrum_sel(f.endless, spectrum_of(0.0f), f.weight);
    return f;
}

/* Step weigh: weights of flights through grids over all wavelengths of a path. */

/* Transmittance of a thickness [majorant density times m] at each wavelength, over the largest of them. */
inline Spectrum grid_passes(Medium m, real thickness)
{
    real least = m.sigma_t.x;
#define C(c) least = min_r(least, m.sigma_t.c);
    SPECTRUM_EACH(C)
#undef C
    return spectrum_exp(spectrum_scale(spectrum_sub(m.sigma_t, spectrum_of(least)), -thickness));
}

/* Updates weight and ratio after a thickness since the last collision. value: the factor of the throughput; pdf: of the
 * event; both at each wavelength, without the transmittance, whose common factor cancels. */
inline void grid_weigh(Medium m, real thickness, Spectrum value, Spectrum pdf, mask active, GridFlight *f)
{
    Spectrum passes = grid_passes(m, thickness);
    Spectrum pdfs = spectrum_mul(f->ratio, spectrum_mul(pdf, passes));
    real mean = spectrum_mean(pdfs), inverse = sel(mean > 1e-30f, 1.0f / mean, (real)(0.0f));
    Spectrum weight = spectrum_scale(spectrum_mul(value, passes), inverse);
    f->ratio = spectrum_sel(active, spectrum_scale(pdfs, inverse), f->ratio);
    f->weight = spectrum_sel(active, spectrum_mul(f->weight, weight), f->weight);
}

/* The random number that chooses a wavelength. */
inline real grid_hero(natural bits) { return unit_interval(hash_natural(bits ^ 0x51ed270bu)); }

/* Updates flights that reach the end of the ray. */
inline void grid_weigh_end(Medium m, real thickness, mask active, GridFlight *f)
{
    grid_weigh(m, thickness, spectrum_of(1.0f), spectrum_of(1.0f), active, f);
}

/* Twin, where extinction is the same at all wavelengths. */
inline void grid_weigh(Medium m, real thickness, Spectrum value, Spectrum pdf, mask active, GridFlight *f)
{
    Spectrum weight = spectrum_scale(value, 1.0f / max_r(pdf.x, (real)(1e-30f)));
    f->weight = spectrum_sel(active, spectrum_mul(f->weight, weight), f->weight);
}
inline real grid_hero(natural bits) { return (real)(0.0f); }
inline void grid_weigh_end(Medium m, real thickness, mask active, GridFlight *f) {}

/* Step gather: emission that flights gather in grids. */
#include "generated/brick_weight.cl"

/* Adds the emission of a brick from w.t to `to`; passed: see grid_flight. */
inline void grid_gather(Scene scene, integer name, Medium m, GridWalk w, GridBrick b, real to, real passed, mask dims,
                        natural bits, mask active, GridFlight *f, Wavelengths lambdas, Slab path, uint at)
{
    integer row = grid_light_row(scene, name, w, active);
    active = active & (row != 0) & (to > w.t);
    if (!any(active)) return;
    real way = to - w.t, part = unit_interval(hash_natural(bits ^ 0x3c6ef372u)) * way;
    w.t = sel(active, w.t + part, w.t);
    real w_met = brick_weight(scene, path, at, row, active, w.t);
    Spectrum light = grid_emission(scene, name, m, w, b, active, hash_natural(bits ^ 0xdaa66d2bu), lambdas);
    GridFlight here = *f;
    grid_weigh(m, passed + sel(dims, (real)(0.0f), b.most * part), spectrum_of(1.0f), spectrum_of(1.0f), active, &here);
    light = spectrum_scale(spectrum_mul(here.weight, light), way * w_met);
    f->light = spectrum_sel(active, spectrum_add(f->light, light), f->light);
}

/* Twin, where no grid emits. */
inline void grid_gather(Scene scene, integer name, Medium m, GridWalk w, GridBrick b, real to, real passed, mask dims,
                        natural bits, mask active, GridFlight *f, Wavelengths lambdas, Slab path, uint at) {}

/* Step collision: collisions in grids whose colours differ from point to point, and that are no mixtures. Real and
 * null collisions are weighed over a path's wavelengths, as distances are: the choice by the hero wavelength alone
 * leaves noise of colour. */

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

/* Step collision_mixed: collisions in mixtures. */

/* The part of a mixture that light collides with at the point that `bits` choose: its phase function, and its
 * scattering where the density of the bricks is 1. The probability of a part is its share of the scattering at the hero
 * wavelength, which `ratio` and `hero` choose. Other media are returned unchanged. */
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

/* Step brick_weight: the MIS weight of emission that a flight gathers in a brick at distance t, against next-event
 * estimation, by the density of the flight's direction and where it was sampled; row: 1 + the brick's row of `lights`.
 * A GPU reads these again in each brick, as in lights/sky.cl. */
inline real brick_weight(Scene scene, Slab path, uint at, integer row, mask active, real t)
{
    if (LANES == 1) at = any(row > scene.settings->light_count) ? 0u : at;
    real pdf = load_path_pdf(path, at), w_met = 1.0f;
    mask sought = active & (row > 0) & (pdf >= 0.0f);
    if (any(sought)) {
        real ray_offset = sel(active, load_path_ray_offset(path, at), (real)(0.0f));
        vec3 d = load_path_d(path, at), o = madd3(d, -ray_offset, load_path_o(path, at));
        real before = load_path_null_distance(path, at) - ray_offset;
        integer one = sel_i(sought, row - 1, (integer)(0));
        vec3 from = madd3(d, -before, o);
        real own = brick_light_pdf(scene, one, from, path_receiver(path, at), before + t);
        w_met = sel(sought, mis_weight(pdf, own), w_met);
    }
    return w_met;
}

/* Twin, where no brick is a light. */
inline real brick_weight(Scene scene, Slab path, uint at, integer row, mask active, real t) { return (real)(1.0f); }
