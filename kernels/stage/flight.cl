/* Takes rays through media: a ray either comes to where it ends, or meets the medium before. Then that is where it
 * ends, and the medium's phase function is its material. Both are chosen by the extinction at the hero wavelength, and
 * weighed over all of the path's wavelengths (Miller, Georgiev and Jarosz 2019, with one sample): `ratio` does it as
 * for directions, see path/hero.cl. Light that is absorbed is a weight, never an end. Some flights end near lamps, see
 * media/equiangular.cl; both ways to choose are weighed by their sum. */
#include "core/base.cl"
#include "interface/stage.cl"
#include "generated/sampler.cl"
#include "path/path_state.cl"
#include "generated/textures.cl"
#include "generated/medium.cl"
#include "generated/grid_flight.cl"
#include "generated/flight_args.cl"
#include "generated/flight_layers.cl"
#include "media/equiangular.cl"

#define FLIES_NEAR_LAMPS (MEDIUM_AIMS && !LIGHT_PATHS) /* paths from lamps have no reason to stay there */

#if !USES_BODIES
/* The medium of a ray; one that knows of none is in that of the side of the surface that it meets. */
inline integer flight_medium(Scene scene, Slab path, Slab hit, uint at, mask met)
{
    ShapeMedia own = shape_media(scene, sel_i(met, load_hit_shape(hit, at), (integer)(0)));
    mask front = dot3(load_hit_n(hit, at), load_path_d(path, at)) < 0.0f;
    integer medium = load_path_medium(path, at);
    return sel_i(met & (medium == 0), sel_i(front, own.outside, own.inside), medium);
}
#endif

STAGE(flight)(SLAB_ARGS, SCENE_ARGS FLIGHT_ARGS STAGE_AT_ARG)
{
    SLABS
    SCENE
    STAGE_AT
    integer state = load_path_state(path, at);
    mask alive = (state & PATH_ALIVE) != 0, met = alive & (load_hit_prim(hit, at) >= 0);
#if USES_BODIES /* of a surface in a body of higher priority nothing is seen */
    integer name = load_path_medium(path, at), shape = sel_i(met, load_hit_shape(hit, at), (integer)(0));
    mask front = dot3(load_hit_n(hit, at), load_path_d(path, at)) < 0.0f;
    BodyBoundary boundary = body_boundary(scene, shape, load_path_bodies(path, at), front);
    store_hit_material(hit, at, met & boundary.hidden, body_word(scene, (integer)(0), 0));
#else
    integer name = flight_medium(scene, path, hit, at, met);
    store_path_medium(path, at, alive, name);
#endif
    mask flies = alive & ((name & MEDIUM_FLIES) != 0);
    if (any(flies)) {
        Wavelengths lambdas = load_path_lambdas(path, at);
        Medium m = medium_load(scene, sel_i(flies, name, (integer)(0)), lambdas);
        Spectrum ratio = load_path_ratio(path, at);
        Sampler sampler = pixel_sampler(settings, load_path_pixel_key(path, at), load_path_sample(path, at));
        integer vertex = (state & PATH_DEPTH) + load_path_nulls(path, at);
        vec2 u = sampler_pair(sampler, as_natural(DIMENSION_FLIGHT + vertex));
        mask scatters = flies & (spectrum_max(m.sigma_s) > 0.0f);
        /* The medium begins at the surface, before the ray's origin, which lies off it. */
        real lead = sel(flies, load_path_lead(path, at), (real)(0.0f));
        vec3 d = load_path_d(path, at), o = madd3(d, -lead, load_path_o(path, at));
        real sigma = spectrum_pick(m.sigma_t, ratio, u.y), end = sel(met, load_hit_t(hit, at) + lead, (real)(FAR));
#if FLIES_NEAR_LAMPS
        real choice = MEDIUM_AIMS > 1 ? sampler_pair(sampler, as_natural(DIMENSION_AIM + vertex)).x : (real)(0.0f);
        Equiangular near = equiangular(scene, o, d, end, spectrum_mean(m.sigma_t), choice);
#if USES_GRIDS
        near.share = sel((name & MEDIUM_GRID) != 0, (real)(0.0f), near.share);
#endif
        mask aims = scatters & (u.x < near.share);
        real left = 1.0f - near.share, by_angle = equiangular_distance(near, u.x / max_r(near.share, (real)(1e-9f)));
        u.x = max_r(u.x - near.share, (real)(0.0f)) / left;
#endif
#if USES_DYES
        DyeFlight dye = dye_flight(name, m, end);
        mask glows = scatters & (u.x < dye.share);
        real by_dye = dye_distance(dye, u.x / max_r(dye.share, (real)(1e-9f)));
        u.x = max_r(u.x - dye.share, (real)(0.0f)) / (1.0f - dye.share);
#endif
        real t = -log_r(max_r(1.0f - u.x, (real)(1e-9f))) / max_r(sigma, (real)(1e-30f));
#if USES_DYES
        t = sel(glows, by_dye, t);
#endif
#if FLIES_NEAR_LAMPS
        t = sel(aims, by_angle, t);
#endif
        mask collides = scatters & (t < end);
        t = sel(collides, t, end);
        Spectrum passes = spectrum_exp(spectrum_scale(m.sigma_t, -t));
        Spectrum f = spectrum_sel(collides, spectrum_mul(m.sigma_s, passes), passes);
        Spectrum pdf = spectrum_sel(collides, spectrum_mul(m.sigma_t, passes), passes);
#if USES_DYES
        real dyes = sel(collides, dye.share * dye_pdf(dye, t), (real)(0.0f));
        pdf = spectrum_add(spectrum_scale(pdf, 1.0f - dye.share), spectrum_of(dyes));
#endif
#if FLIES_NEAR_LAMPS
        real nearby = sel(collides, near.share * equiangular_pdf(near, t), (real)(0.0f));
        pdf = spectrum_add(spectrum_scale(pdf, left), spectrum_of(nearby));
#endif
        pdf = spectrum_sel(scatters, pdf, spectrum_of(1.0f));
#if USES_RATIO
        Spectrum pdfs = spectrum_mul(ratio, pdf);
        real mean = spectrum_mean(pdfs), inverse = sel(mean > 1e-30f, 1.0f / mean, (real)(0.0f));
        store_path_ratio(path, at, flies, spectrum_scale(pdfs, inverse));
        Spectrum weight = spectrum_scale(f, inverse);
#else
        Spectrum weight = spectrum_scale(f, 1.0f / max_r(pdf.x, (real)(1e-30f)));
#endif
#if MEDIA_EMIT
        Spectrum light = medium_emission(scene, sel_i(flies, name, (integer)(0)), m, end, lambdas);
#endif
#if USES_GRIDS
        mask gridded = flies & ((name & MEDIUM_GRID) != 0);
        if (any(gridded)) {
            natural key = grid_key(scene, load_path_pixel_key(path, at), load_path_sample(path, at), vertex);
            GridOrigin origin = {(real)(0.0f), (real)(0.0f), o, d};
#if GRIDS_EMIT
            origin.pdf = load_path_pdf(path, at);
            origin.before = load_path_null_distance(path, at) - lead;
            origin.from = madd3(d, -origin.before, o);
            origin.hemisphere = path_hemisphere(path, at);
#endif
            GridFlight own = grid_flight(scene, name, m, o, d, end, ratio, u, key, gridded, lambdas, origin);
#if GRIDS_EMIT
            light = spectrum_sel(gridded, own.light, light);
#endif
            weight = spectrum_sel(gridded, own.weight, weight);
            collides = sel_i(gridded, own.collides, collides);
            t = sel(gridded, own.t, t);
            store_path_ratio(path, at, gridded, own.ratio);
            m.phase = sel_i(gridded, own.phase, m.phase);
        }
#endif
#if MEDIA_EMIT
        light = spectrum_mul(load_path_beta(path, at), light);
        store_path_radiance(path, at, flies, spectrum_add(load_path_radiance(path, at), light));
#if LIGHT_LAYERS && !LIGHT_PATHS /* of the group that is told behind those of all lights */
        integer rest = settings->light_count;
        light_layers_add(scene, path, at, flies, state & PATH_DEPTH, rest, light, light_layers);
#endif
#endif
        store_path_beta(path, at, flies, spectrum_mul(load_path_beta(path, at), weight));
        store_hit_t(hit, at, collides, t - lead);
        store_hit_prim(hit, at, collides, (integer)(0));
        store_hit_material(hit, at, collides, m.phase);
    }
}
