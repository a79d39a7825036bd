/* Gathers photons along rays from the camera through media whose phase function is of a kind: before stage/flight.cl
 * chooses where they collide. */
#include "stage/stage.cl"
#include "generated/merge_args.cl"
#include "generated/gather_args.cl"
#include "generated/sampler.cl"
#include "generated/scouts.cl"
#include "shapes/surface.cl#flags"
#include "generated/textures.cl"
#include "materials/bsdf.cl"
#include "generated/bsdf.cl"
#include "generated/medium.cl"
#include "generated/hero_steps.cl"
#include "materials/bsdf.cl#pair"
#include "generated/light_layers.cl"
#include "generated/flight_medium.cl"
#include "transport/photons/area.cl"
#include "generated/photon.cl"
#include "transport/photons/along.cl"

STAGE(gather_along)(SLAB_ARGS, SCENE_ARGS GATHER_ARGS STAGE_AT_ARG)
{
    STAGE_BEGIN
    integer state = load_path_state(path, at);
    mask alive = (state & PATH_ALIVE) != 0, met = alive & (load_hit_prim(hit, at) >= 0);
    mask merges = alive & !path_scouts(state) & merging_here(state, state & PATH_DEPTH);
    integer medium = 0, word = -1;
    if (any(merges)) {
        medium = flight_medium(scene, path, hit, at, alive, met);
        word = merging_phase(scene, medium);
        merges = merges & (MATERIAL_KIND(word) == (integer)(BSDF_KIND));
    }
    if (any(merges)) {
        Wavelengths lambdas = load_path_lambdas(path, at);
        integer sample = load_path_sample(path, at);
        Sampler sampler = pixel_sampler(settings, load_path_pixel_key(path, at), sample);
        natural vertex = as_natural((state & PATH_DEPTH) + load_path_nulls(path, at));
        real ray_offset = sel(merges, load_path_ray_offset(path, at), (real)(0.0f));
        vec3 d = load_path_d(path, at);
        MergingRay ray;
        ray.o = madd3(d, -ray_offset, load_path_o(path, at));
        ray.d = d;
        ray.end = sel(met, load_hit_t(hit, at) + ray_offset, (real)(FAR));
        ray.medium = sel_i(merges, medium, (integer)(0));
        ray.depth = state & PATH_DEPTH;
        ray.group = merging_group_of(scene, sampler) | MERGING_IN_MEDIUM;
        ray.m = medium_load(scene, ray.medium, lambdas);
        ray.ratio = load_path_ratio(path, at);
        ray.arrives = load_path_mis_ratio(path, at);
        integer row = sel_i(merges, MATERIAL_ROW(word), (integer)(0));
        Bsdf bsdf = bsdf_load(scene, row, texture_point_nowhere(), lambdas);
        real u = sampler_pair(sampler, DIMENSION_FLIGHT + vertex).x;
        Spectrum light = merge_along(scene, merges, ray, bsdf, sample, u MERGE_PASSED);
        light = spectrum_mul(load_path_beta(path, at), light);
        light_layers_add(scene, path, at, merges, (integer)(2), (integer)(0), (real)(0.0f), light LIGHT_LAYER_PASSED);
        store_path_radiance(path, at, merges, spectrum_add(load_path_radiance(path, at), light));
    }
}
