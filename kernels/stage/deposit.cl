/* Keeps as photons the light paths that meet a surface after something sharp, before a material is chosen there. Each
 * vertex of each light path of a pass has a place of its own, so that nothing is dropped and no order counts. */
#include "core/base.cl"
#include "core/octahedral.cl"
#include "interface/stage.cl"
#include "generated/deposit_args.cl"
#include "generated/sampler.cl"
#include "interface/shape.cl"
#include "generated/shapes.cl"
#include "generated/medium.cl"
#include "surface/surface.cl"
#include "lighting/light_path_sampler.cl"
#include "merging/area.cl"
#include "merging/cells.cl"
#include "generated/photon_numbers.cl"
#include "merging/weight.cl"
#include "generated/photon.cl"
#include "merging/media.cl"

STAGE(deposit)(SLAB_ARGS, SCENE_ARGS DEPOSIT_ARGS STAGE_AT_ARG)
{
    SLABS
    SCENE
    STAGE_AT
    integer state = load_path_state(path, at), depth = state & PATH_DEPTH;
    integer pixel_index = load_path_pixel_index(path, at), kind = MATERIAL_KIND(load_hit_material(hit, at));
    mask active = ((state & PATH_ALIVE) != 0) & ((state & PATH_SHARP) != 0) & (load_hit_prim(hit, at) >= 0);
    active = active & (depth < settings->max_depth) & (pixel_index < settings->photon_pixels) & photon_met(kind);
#if USES_MEDIA
    integer name = sel_i(active, load_path_medium(path, at), (integer)(0));
    mask collides = photon_collides(MATERIAL_KIND(merging_part(scene, active, load_hit_material(hit, at))));
    active = active & (!collides | photon_along(MATERIAL_KIND(merging_phase(scene, name))));
#endif
    if (any(active)) {
        scene.time = load_path_time(path, at);
        integer sample = load_path_sample(path, at), pass = merging_pass(scene, sample), group = 0;
        mask front;
        vec3 d = load_path_d(path, at);
        Surface s = surface_load(scene, hit, at, active, load_path_o(path, at), d, &front);
        Photon photon;
#if USES_MEDIA
        s.p = sel3(collides, madd3(d, load_hit_t(hit, at), load_path_o(path, at)), s.p);
#endif
        photon.p = s.p;
        photon.power = load_path_beta(path, at);
#if USES_RATIO && SPECTRUM_SIZE == 4 /* whose hero the other path shares */
        photon.ratio = load_path_ratio(path, at);
#else
        photon.ratio = spectrum_of(1.0f);
#endif
        photon.to_light = octahedral_pack(neg3(d));
        photon.normal = octahedral_pack(s.n);
        photon.rival = photon_rival(load_path_rival(path, at), dot3(s.n, d));
#if USES_MEDIA /* by which medium it is in, and without a cosine */
        photon.normal = sel_n(collides, as_natural(name), photon.normal);
        photon.rival = sel(collides, load_path_rival(path, at), photon.rival);
#endif
#if USES_ABSORPTION
        integer medium = sel_i(active, load_path_medium(path, at), (integer)(0));
        real through = load_hit_t(hit, at) + sel(active, load_path_lead(path, at), (real)(0.0f));
        Wavelengths lambdas = load_path_lambdas(path, at);
        medium = MEDIUM_LEFT(medium);
        photon.power = spectrum_mul(photon.power, medium_transmittance(scene, medium, through, lambdas));
#endif
#if SPECTRUM_SIZE == 4
        Sampler sampler = light_path_sampler(settings, pixel_index, sample);
        group = merging_group(scene, sampler_pair(sampler, (natural)(DIMENSION_WAVELENGTH)).x);
#endif
#if USES_MEDIA
        group = group | sel_i(collides, (integer)(MERGING_IN_MEDIUM), (integer)(0));
#endif
        photon.depth = depth | group << 16;
        int number = (int)settings->light_paths, places = settings->photon_places;
        integer place = (pixel_index * number + sample - pass * number) * places + depth - 2;
        Cell cell = cell_at(scene, s.p, 2.0f * merging_radius(scene, pass));
        place = sel_i(active, place, (integer)(0));
        photon_keep(photons, place * PHOTON_WORDS, active, photon);
        integer cell_of = cell_number(scene, cell, group);
        scatter_if((global float *)photon_numbers, place, active, as_real(cell_of));
    }
}
