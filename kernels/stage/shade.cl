/* Shades the paths that met one kind of material. Built once per kind, so it holds no switch: LANES neighbouring slots,
 * in which other kinds are masked out, or, where QUEUED, those from `entry` of the kind's queue on. */
#include "core/base.cl"
#include "interface/stage.cl"
#include "generated/sampler.cl"
#include "interface/shape.cl"
#include "interface/light.cl"
#include "generated/textures.cl"
#include "generated/shapes.cl"
#include "generated/lights.cl"
#include "path/surface.cl"
#include "generated/shading_frame.cl"
#include "lighting/next_event.cl"
#include "optics/fresnel.cl"
#include "optics/microfacet.cl"
#include "interface/bsdf.cl"
#include "generated/bsdf.cl"
#include "generated/medium.cl"
#include "path/vertex.cl"
#include "path/hero.cl"
#include "path/roulette.cl"
#include "generated/integrator.cl"
#include "path/block.cl"

#if !QUEUED
#define QUEUE_ARGS STAGE_AT_ARG
#elif defined(PART)
#define QUEUE_ARGS , global const uint *queue, uint entry, uint end, uint block
#else
#define QUEUE_ARGS , global const uint *queue, global const uint *queue_starts, global const uint *queue_counts
#endif

STAGE(shade)(SLAB_ARGS, SCENE_ARGS QUEUE_ARGS)
{
    SLABS
    SCENE
#if QUEUED
#ifndef PART
    uint first = get_global_id(0) * LANES, entry = queue_starts[BSDF_KIND] + first;
    uint end = queue_starts[BSDF_KIND] + queue_counts[BSDF_KIND], block = settings->slots + first;
#endif
    if (entry < end) {
        uint at = block_take(path, hit, shadow, queue, entry, end, block);
        integrator_vertex(scene, path, hit, shadow, at, LANE_INDEX + (integer)((int)entry) < (int)end);
        block_return(path, shadow, queue, entry, end, block);
    }
#else
    STAGE_AT
    mask active = ((load_path_state(path, at) & PATH_ALIVE) != 0) & (load_hit_prim(hit, at) >= 0);
#if BSDF_COUNT > 1
    active = active & (MATERIAL_KIND(load_hit_material(hit, at)) == BSDF_KIND);
#endif
    if (any(active)) integrator_vertex(scene, path, hit, shadow, at, active);
#endif
}
