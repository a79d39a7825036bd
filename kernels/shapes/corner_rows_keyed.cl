/* Rows of three floats of a vertex, where some meshes deform: at the scene's time. */
typedef VertexKeys CornerKeys;
#define corner_vec3(table, vertex, keys) vertex_keyed(table, vertex, keys)

/* The rows of a shape's vertices at the time; the first where it does not deform. */
inline VertexKeys corner_keys(Scene scene, ShapeRow shape, mask active)
{
    mask deforms = active & ((shape.flags & SHAPE_DEFORMS) != 0);
    VertexKeys still = {(integer)(1), (integer)(0), (integer)(0), (real)(0.0f)};
    if (!any(deforms)) return still;
    VertexKeys k = vertex_keys(scene, sel_i(deforms, shape.number, (integer)(0)), scene.time);
    k.count = sel_i(deforms, k.count, still.count);
    k.key = sel_i(deforms, k.key, still.key);
    k.next = sel_i(deforms, k.next, still.next);
    k.share = sel(deforms, k.share, still.share);
    return k;
}
