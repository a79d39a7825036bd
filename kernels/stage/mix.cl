/* Chooses a leaf for every hit on a mixture (a mask or a blend), at random by its weight, so that later
 * stages shade a single material. A row of `mixtures`: the weight (a number and 1 + its texture), and the
 * material words taken where a random number is above and below it; these may be mixtures again. */
#include "stage/stage.cl"
#include "generated/sampler.cl"
#include "shapes/shape.cl"
#include "generated/textures.cl"
#include "generated/mixture.cl"
#include "generated/scout_choice.cl"
#include "generated/shapes.cl"
#include "shapes/surface.cl"

STAGE(mix_materials)(SLAB_ARGS, SCENE_ARGS STAGE_AT_ARG)
{
    STAGE_BEGIN
    integer state = load_path_state(path, at), word = load_hit_material(hit, at);
    mask active = ((state & PATH_ALIVE) != 0) & (load_hit_prim(hit, at) >= 0);
    mask open = active & (MATERIAL_KIND(word) == MATERIAL_MIXTURE);
    if (any(open)) {
        scene.time = load_path_time(path, at);
        mask front, chosen = open;
        Surface s = surface_load(scene, hit, at, open, load_path_o(path, at), load_path_d(path, at), &front);
        Wavelengths lambdas = load_path_lambdas(path, at);
        Sampler sampler = pixel_sampler(scene.settings, load_path_pixel_key(path, at), load_path_sample(path, at));
        integer met = (state & PATH_DEPTH) + load_path_nulls(path, at);
        natural dimension = as_natural(DIMENSION_VERTEX + met * DIMENSIONS_A_VERTEX + DIMENSION_ROULETTE);
        real u = sampler_pair(sampler, dimension).y;
        u = scout_choice(scene, load_path_pixel_key(path, at), state, dimension, u);
        for (; any(open); open = open & (MATERIAL_KIND(word) == MATERIAL_MIXTURE)) {
            integer row = sel_i(open, MATERIAL_ROW(word), (integer)(0));
            real w = mixture_weight(scene, row, surface_texture_point(s), lambdas);
            mask second = u < w;
            /* The rest of u is as good as a new number. */
            u = min_r(sel(second, u / max_r(w, (real)(1e-20f)), (u - w) / max_r(1.0f - w, (real)(1e-20f))),
                      (real)(0.9999999f));
            integer next = sel_i(second, gather_i(scene.mixtures, row + 3), gather_i(scene.mixtures, row + 2));
            word = sel_i(open, next, word);
        }
        store_hit_material(hit, at, chosen, word);
    }
}
