/* Hits of few other shapes beside curves, such as a spherical lamp: each is tested against all lanes. */
#include "generated/shape_tree.cl"
#define CURVE_OTHERS scene.settings->single_count /* primitives below are not curves */

/* Adds to `hit` the active lanes' hits before t of primitives that are not curves. */
inline ShapeHit curve_others(Scene scene, integer prim, mask active, vec3 o, vec3 d, real t, ShapeHit hit)
{
    TraceInteger prims = {prim}, left = {active & (prim < CURVE_OTHERS)};
    for (uint i = 0; i < LANES; i++) {
        if (!left.at[i]) continue;
        int shape = prims.at[i];
        ShapeHit own = shape_hit(scene, shape, shape_row_like(scene, shape), o, d, (real)(0.0f), t);
        mask same = (left.v != 0) & (prim == shape);
        hit.t = sel(same, own.t, hit.t);
        hit.n = sel3(same, own.n, hit.n);
        hit.uv.x = sel(same, own.uv.x, hit.uv.x);
        hit.uv.y = sel(same, own.uv.y, hit.uv.y);
        left.v = sel_i(same, (integer)(0), left.v);
    }
    return hit;
}

/* Twin, where there are none. */
inline ShapeHit curve_others(Scene scene, integer prim, mask active, vec3 o, vec3 d, real t, ShapeHit hit)
{
    return hit;
}
#define CURVE_OTHERS 0
