/* Keeps as photons the light paths that meet a surface, or collide in a medium, after something sharp, before a
 * material is chosen there. Each vertex of each light path of a pass has a place of its own, so that nothing is dropped
 * and no order counts. */
#include "stage/stage.cl"
#include "generated/deposit_args.cl"
#include "generated/sampler.cl"
#include "shapes/shape.cl"
#include "generated/shapes.cl"
#include "generated/medium.cl"
#include "shapes/surface.cl"
#include "transport/light_path.cl#sampler"
#include "transport/photons/area.cl"
#include "transport/photons/cells.cl"
#include "generated/photon_numbers.cl"
#include "transport/photons/weight.cl"
#include "generated/photon.cl"
#include "generated/collisions.cl"

STAGE(deposit)(SLAB_ARGS, SCENE_ARGS DEPOSIT_ARGS STAGE_AT_ARG)
{
    STAGE_BEGIN
    integer state = load_path_state(path, at), depth = state & PATH_DEPTH;
    integer pixel_index = load_path_pixel_index(path, at), kind = MATERIAL_KIND(load_hit_material(hit, at));
    mask active = ((state & PATH_ALIVE) != 0) & ((state & PATH_SHARP) != 0) & (load_hit_prim(hit, at) >= 0);
    active = active & (depth < settings->max_depth) & (pixel_index < settings->photon_pixels) & photon_met(kind);
    Collision collision = collision_met(scene, path, hit, at, &active);
    if (any(active)) {
        scene.time = load_path_time(path, at);
        integer sample = load_path_sample(path, at), pass = merging_pass(scene, sample), group = 0;
        mask front;
        vec3 d = load_path_d(path, at);
        Surface s = surface_load(scene, hit, at, active, load_path_o(path, at), d, &front);
        Photon photon;
        photon.p = s.p;
        photon.power = load_path_beta(path, at);
#if USES_RATIO && SPECTRUM_SIZE == 4 /* whose hero the other path shares */
        photon.ratio = load_path_ratio(path, at);
#else
        photon.ratio = spectrum_of(1.0f);
#endif
        photon.to_light = octahedral_pack(neg3(d));
        photon.normal = octahedral_pack(s.n);
        photon.mis_ratio = photon_mis_ratio(load_path_mis_ratio(path, at), dot3(s.n, d));
#if USES_ABSORPTION
        integer medium = sel_i(active, load_path_medium(path, at), (integer)(0));
        real through = load_hit_t(hit, at) + sel(active, load_path_ray_offset(path, at), (real)(0.0f));
        Wavelengths lambdas = load_path_lambdas(path, at);
        medium = medium_left(medium);
        photon.power = spectrum_mul(photon.power, medium_transmittance(scene, medium, through, lambdas));
#endif
        group = merging_group_of(scene, light_path_sampler(settings, pixel_index, sample));
        collision_photon(path, hit, at, collision, &photon, &group);
        photon.depth = depth | group << 16;
        int number = (int)settings->light_paths, places = settings->photon_places;
        integer place = (pixel_index * number + sample - pass * number) * places + depth - 2;
        Cell cell = cell_at(scene, photon.p, 2.0f * merging_radius(scene, pass));
        place = sel_i(active, place, (integer)(0));
        photon_keep(photons, place * PHOTON_WORDS, active, photon);
        integer cell_of = cell_number(scene, cell, group);
        scatter_if((global float *)photon_numbers, place, active, as_real(cell_of));
    }
}
