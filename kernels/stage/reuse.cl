/* Computes, for each path of a group, the density of each second vertex of the group: see transport/reuse.cl. */
#include "stage/stage.cl"
#include "shapes/shape.cl"
#include "generated/trace.cl"
#include "core/rounding.cl"
#include "transport/reuse.cl"

#define REUSE_COSINE 1e-6f /* the least of a path's own direction, for roundings */

STAGE(reuse)(SLAB_ARGS, SCENE_ARGS, TRACE_ARGS STAGE_AT_ARG)
{
    STAGE_BEGIN
    integer reuse = load_path_reuse(path, at);
    mask waits = (reuse != 0) & ((reuse & REUSE_WEIGHED) == 0), some = mask_of(0);
    if (!any(waits)) return;
    for (uint k = 0; k < REUSE_GROUP; k++) some = some | (reuse_vertices(path, at, k) == REUSE_SECOND);
    waits = waits & some;
    if (!any(waits)) return;
    store_path_reuse(path, at, waits, reuse | REUSE_WEIGHED);
    vec3 x = load_path_reuse_x(path, at);
    vec3 n = octahedral_unpack(load_path_reuse_n(path, at)), ns = octahedral_unpack(load_path_reuse_ns(path, at));
    /* half of it is the share of directions about the shading normal that are above the surface: only these share */
    real above = max_r(1.0f + dot3(n, ns), (real)(REUSE_COSINE));
    for (uint k = 0; k < REUSE_GROUP; k++) {
        mask own = ((LANE_INDEX + (int)at) & (REUSE_GROUP - 1)) == (int)k;
        mask asks = waits & (reuse_vertices(path, at, k) == REUSE_SECOND);
        real density = 0.0f;
        if (any(asks)) {
            vec3 to = sub3(reuse_point(path, PATH_REUSE_Y_WORD, at, k), x);
            real square = max_r(dot3(to, to), (real)(1e-20f)), t = sqrt(square);
            vec3 d = scale3(to, 1.0f / t);
            real departs = dot3(ns, d), arrives = -dot3(reuse_normal(path, PATH_REUSE_YN_WORD, at, k), d);
            mask faces = (departs > 0.0f) & (dot3(n, d) > 0.0f) & (arrives > 0.0f);
            faces = faces & (dot3(reuse_normal(path, PATH_REUSE_YNS_WORD, at, k), d) < 0.0f);
            mask sees = asks & faces & !own;
            if (any(sees)) sees = sees & !trace_occluded(TRACE_PASSED, scene, x, d, t * SHADOW_SHORTER, sees);
            density = max_r(departs, (real)(REUSE_COSINE)) * max_r(arrives, (real)(REUSE_COSINE));
            density = 2.0f * density / (above * square);
            density = sel(sees | (asks & own), density, (real)(0.0f));
        }
        slab_write(path, PATH_REUSE_DENSITY0_WORD + k, at, waits, density);
    }
}
