/* Finds where every ray in flight ends. Triangles go through a layout of kernels/bvh, as many
 * rays a work-item as it likes; analytic shapes through a tree of their own, a ray at a time. The hit includes the
 * normal and the material of its side, which shading needs first. */
#include "stage/stage.cl"
#include "shapes/shape.cl"
#include "shapes/surface.cl#flags"
#include "generated/trace.cl"
#include "generated/reuse_meets.cl"

STAGE(intersect)(SLAB_ARGS, SCENE_ARGS, TRACE_ARGS STAGE_AT_ARG)
{
    STAGE_BEGIN
    integer state = load_path_state(path, at);
    mask active = (state & PATH_ALIVE) != 0;
    if (any(active)) {
        scene.time = load_path_time(path, at);
        vec3 o = load_path_o(path, at), d = load_path_d(path, at);
        reuse_meets(path, at, active, state, o);
        /* at depth 0 Path.pdf is minus the range of the camera ray */
        real far = sel((state & PATH_DEPTH) == 0, -load_path_pdf(path, at), (real)(FAR));
        TraceHit h = trace_closest(TRACE_PASSED, scene, o, d, far, active);
        integer shape = sel_i(h.prim >= 0, h.shape, (integer)(0)), row = shape * SHAPE_ROW_WORDS;
        ShapeRow s = shape_row_row(scene.shapes, row);
        store_hit_t(hit, at, active, h.t);
        store_hit_u(hit, at, active, h.u);
        store_hit_v(hit, at, active, h.v);
        store_hit_n(hit, at, active, h.n);
        store_hit_plane(hit, at, active, h.plane);
        store_hit_side(hit, at, active, h.side);
        store_hit_prim(hit, at, active, h.prim);
        store_hit_shape(hit, at, active, shape);
        store_hit_instance(hit, at, active, h.instance);
        store_hit_material(hit, at, active, sel_i(dot3(h.n, d) < 0.0f, s.front, s.back));
    }
}
