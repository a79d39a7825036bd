/* Shades the paths that met a kind of material. Built once per kind, so it holds no switch: LANES neighbouring slots,
 * with other kinds masked out, or, where QUEUED, a slot of the kind's queue. Where a text is whole, read it
 * from its end: first the stage, then `integrator_vertex` above it, whose steps stand above that in their order. */
#include "stage/stage.cl"
#include "generated/merge_args.cl"
#include "generated/shade_args.cl"
#include "generated/sampler.cl"
#include "shapes/shape.cl"
#include "lights/light.cl"
#include "generated/textures.cl"
#include "generated/shapes.cl"
#include "generated/lights.cl"
#include "shapes/surface.cl"
#include "generated/shading_frame.cl"
#include "lights/light.cl#next_event"
#include "lights/light.cl#begins"
#include "generated/common.cl"
#include "materials/fresnel.cl"
#include "materials/microfacet.cl"
#include "materials/bsdf.cl"
#include "generated/bsdf.cl"
#include "generated/medium.cl"
#include "transport/vertex.cl"
#include "spectra/hero.cl#sample"
#include "generated/integrator.cl"

#if QUEUED
#define QUEUE_ARGS , global const uint *queue, global const uint *queue_starts, global const uint *queue_counts
#else
#define QUEUE_ARGS STAGE_AT_ARG
#endif

#if SHADES_BOTH /* paths from the camera and from lights */
#define WHICH_ARG , uint which
#define WHICH_PASSED , which
#else
#define WHICH_ARG
#define WHICH_PASSED
#endif

#if SHADES_SEVERAL /* kinds, LANES paths of the same kind at a time */
#define KIND_ARG , uint kind
#else
#define KIND_ARG
#endif

STAGE(shade)(SLAB_ARGS, SCENE_ARGS SHADE_ARGS WHICH_ARG KIND_ARG QUEUE_ARGS)
{
    SLABS
    SCENE
#if SHADES_SEVERAL
    scene.kind = kind;
#endif
#if QUEUED
    uint entry = get_global_id(0);
    if (entry < queue_counts[BSDF_KIND]) {
        scene.time = load_path_time(path, queue[queue_starts[BSDF_KIND] + entry]);
        integrator_vertex(scene, path, hit, shadow, queue[queue_starts[BSDF_KIND] + entry], mask_of(1) SHADE_PASSED);
    }
#else
    STAGE_AT
    mask active = ((load_path_state(path, at) & PATH_ALIVE) != 0) & (load_hit_prim(hit, at) >= 0);
#if BSDF_COUNT > 1
    active = active & (MATERIAL_KIND(load_hit_material(hit, at)) == (integer)(BSDF_KIND));
#endif
    scene.time = load_path_time(path, at);
    if (any(active)) integrator_vertex(scene, path, hit, shadow, at, active SHADE_PASSED WHICH_PASSED);
#endif
}
