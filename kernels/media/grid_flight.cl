/* Flights through a medium on a grid, by delta tracking (Woodcock 1965); null collisions are weighed over the path's
 * wavelengths, as other events are (Miller, Georgiev and Jarosz 2019).
 *
 * Where some grids emit, a flight gathers emission at a random point of each segment between collisions and brick
 * boundaries: the point is uniform, and weighed by the transmittance to it. Next-event estimation samples the same
 * light (lights/kinds/emissive_brick.cl); MIS combines both. */
/* The end of a flight, and its weight; `ratio` as in spectra/hero.cl. */
typedef struct {
    mask collides, endless; /* endless: after MOST_NULL_COLLISIONS its weight is 0 */
    real t;                 /* [m] */
    Spectrum weight, ratio;
    Spectrum light; /* gathered emission, where some grids emit */
    integer phase;  /* material word of the colliding part's phase function */
} GridFlight;

/* The density of a flight's direction (see Path.pdf) and where it was sampled, for grids that emit. */
typedef struct {
    real pdf, before; /* [1/sr]; [m] from there to the flight's origin */
    vec3 from;
    Receiver receiver;
} GridOrigin;

#include "generated/flight_steps_of_grids.cl"

/* A flight from o along d through the medium `name`, at most t metres; u: random numbers of its first segment. */
inline GridFlight grid_flight(Scene scene, integer name, Medium m, vec3 o, vec3 d, real t, Spectrum ratio, vec2 u,
                              natural key, mask active, Wavelengths lambdas, GridOrigin origin)
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
        GridBrick b = grid_brick(scene, w, active);
        real thick = b.most * (b.exit - w.t);
        mask meets = active & (thick > left);
        real to = sel(meets, min_r(w.t + left / max_r(b.most, (real)(1e-30f)), b.exit), b.exit);
        natural gathers = hash_natural(key ^ (0x9b05688cu + ways * 0x85ebca6bu));
        grid_gather(scene, name, m, w, b, to, passed, dims, gathers, active, &f, lambdas, origin);
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
