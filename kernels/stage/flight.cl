/* Takes rays through media: a ray either comes to its end, or collides with the medium before. Then it ends there, and
 * the medium's phase function is its material. Both are chosen by the extinction at the hero wavelength, and weighed
 * over all of the path's wavelengths (Miller, Georgiev and Jarosz 2019, with a single sample): `ratio` does it as for
 * directions, see spectra/hero.cl. Light that is absorbed is a weight, never an end. Some flights end near lamps, see
 * media/equiangular.cl; both ways to choose are weighed by their sum. */
#include "stage/stage.cl"
#include "generated/sampler.cl"
#include "generated/scouts.cl"
#include "generated/textures.cl"
#include "generated/medium.cl"
#include "generated/grid_flight.cl"
#include "generated/flight_args.cl"

/* A ray through a medium, and the numbers of its flight. */
typedef struct {
    vec3 o, d;
    real end, ray_offset; /* where the ray ends, and how far before its origin the medium begins [m] */
    vec2 u;
    integer vertex;
} FlightRay;

#include "generated/flight_steps.cl"


STAGE(flight)(SLAB_ARGS, SCENE_ARGS FLIGHT_ARGS STAGE_AT_ARG)
{
    STAGE_BEGIN
    integer state = load_path_state(path, at);
    mask alive = (state & PATH_ALIVE) != 0, met = alive & (load_hit_prim(hit, at) >= 0);
    integer name = flight_medium(scene, path, hit, at, alive, met);
    mask flies = alive & ((name & MEDIUM_FLIES) != 0) & !path_scouts(state);
    if (any(flies)) {
        Wavelengths lambdas = load_path_lambdas(path, at);
        Medium m = medium_load(scene, sel_i(flies, name, (integer)(0)), lambdas);
        Spectrum ratio = load_path_ratio(path, at);
        Sampler sampler = pixel_sampler(settings, load_path_pixel_key(path, at), load_path_sample(path, at));
        integer vertex = (state & PATH_DEPTH) + load_path_nulls(path, at);
        vec2 u = sampler_pair(sampler, as_natural(DIMENSION_FLIGHT + vertex));
        mask scatters = flies & (spectrum_max(m.sigma_s) > 0.0f);
        /* The medium begins at the surface, before the ray's origin, which lies off it. */
        real ray_offset = sel(flies, load_path_ray_offset(path, at), (real)(0.0f));
        vec3 d = load_path_d(path, at), o = madd3(d, -ray_offset, load_path_o(path, at));
        real sigma = spectrum_pick(m.sigma_t, ratio, u.y);
        real end = sel(met, load_hit_t(hit, at) + ray_offset, (real)(FAR));
        FlightNear near = flight_near(scene, sampler, vertex, name, o, d, end, m, scatters, &u.x);
        FlightDye dye = flight_dye(name, m, end, scatters, &u.x);
        real t = -log_r(max_r(1.0f - u.x, (real)(1e-9f))) / max_r(sigma, (real)(1e-30f));
        t = flight_dye_end(dye, t);
        t = flight_near_end(near, t);
        mask collides = scatters & (t < end);
        t = sel(collides, t, end);
        Spectrum passes = spectrum_exp(spectrum_scale(m.sigma_t, -t));
        Spectrum f = spectrum_sel(collides, spectrum_mul(m.sigma_s, passes), passes);
        Spectrum pdf = spectrum_sel(collides, spectrum_mul(m.sigma_t, passes), passes);
        pdf = flight_dye_pdf(dye, t, collides, pdf);
        pdf = flight_near_pdf(near, t, collides, pdf);
        pdf = spectrum_sel(scatters, pdf, spectrum_of(1.0f));
        Spectrum weight = flight_weight(path, at, flies, ratio, f, pdf);
        Spectrum light = flight_emission(scene, flies, name, m, end, lambdas);
        FlightRay ray = {o, d, end, ray_offset, u, vertex};
        flight_grids(scene, path, at, flies, name, ray, ratio, lambdas, &light, &weight, &collides, &t, &m);
        flight_light(scene, path, at, flies, state, light FLIGHT_PASSED);
        store_path_beta(path, at, flies, spectrum_mul(load_path_beta(path, at), weight));
        store_hit_t(hit, at, collides, t - ray_offset);
        store_hit_prim(hit, at, collides, (integer)(0));
        store_hit_material(hit, at, collides, m.phase);
    }
}
