/* Adds the power of light paths to the guide where they meet a surface, or collide. In whole
 * numbers, whose sums do not depend on the order. */
#include "stage/stage.cl"
#include "generated/deposit_args.cl"
#include "shapes/shape.cl"
#include "generated/shapes.cl"
#include "shapes/surface.cl"
#include "transport/guiding/guide.cl"
#include "generated/train_steps.cl"

#define TRAIN_UNIT 256.0f /* relative to a light path's first power */

STAGE(train)(SLAB_ARGS, SCENE_ARGS DEPOSIT_ARGS STAGE_AT_ARG)
{
    STAGE_BEGIN
    integer state = load_path_state(path, at);
    mask active = ((state & PATH_ALIVE) != 0) & ((state & PATH_DEPTH) > 0) & (load_hit_prim(hit, at) >= 0);
    if (any(active)) {
        scene.time = load_path_time(path, at);
        mask front;
        vec3 d = load_path_d(path, at);
        Surface s = surface_load(scene, hit, at, active, load_path_o(path, at), d, &front);
        vec3 n = sel3(dot3(s.n, d) < 0.0f, s.n, neg3(s.n));
        real shared = 1.0f;
        integer row = collision_row(scene, path, hit, at, active, guide_row(scene, s.p, n), &shared);
        integer straight = guide_straight(scene, row);
        integer entry = sel_i((state & PATH_DEPTH) > 1, row + guide_bin(neg3(d)), straight);
        entry = sel_i(active, entry, (integer)(0));
        real carried = spectrum_mean(load_path_beta(path, at)) * load_path_weight(path, at) / shared;
        integer value = sel_i(active, to_integer(clamp_r(carried, (real)(0.0f), (real)(16.0f)) * TRAIN_UNIT),
                              (integer)(0));
#define ADD(i) if (LANE(value, i)) atomic_add((volatile global uint *)(guide + LANE(entry, i)), (uint)LANE(value, i));
        FOR_LANES(ADD)
#undef ADD
    }
}
