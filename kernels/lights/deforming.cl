/* Lights whose triangles deform: `geometry` has a row of such a triangle for each key, side by side, and all of it is
 * linear from one to the next, as its vertices are (motion/motion.cl). */
#include "motion/motion.cl"
#include "motion/motion.cl#vertex_keys"

inline Triangle triangle_then(Scene scene, LightRow l, mask active)
{
    integer row = sel_i(active & (l.shape >= 0), l.shape, (integer)(0)) * SHAPE_ROW_WORDS;
    ShapeRow shape = shape_row_row(scene.shapes, row);
    mask deforms = active & ((shape.flags & SHAPE_DEFORMS) != 0);
    integer at = sel_i(active, l.params, (integer)(0));
    Triangle s = triangle_row(scene.geometry, at);
    if (any(deforms)) {
        VertexKeys k = vertex_keys(scene, sel_i(deforms, shape.number, (integer)(0)), scene.time);
        integer first = at + sel_i(deforms, k.key * TRIANGLE_ROW_WORDS, (integer)(0));
        Triangle a = triangle_row(scene.geometry, first);
        Triangle b = triangle_row(scene.geometry, first + sel_i(deforms, k.next * TRIANGLE_ROW_WORDS, (integer)(0)));
        real share = sel(deforms, k.share, (real)(0.0f));
        s.v0 = madd3(a.v0, 1.0f - share, scale3(b.v0, share));
        s.e1 = madd3(a.e1, 1.0f - share, scale3(b.e1, share));
        s.e2 = madd3(a.e2, 1.0f - share, scale3(b.e2, share));
    }
    return s;
}
