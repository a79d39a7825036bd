/* The media around a vertex of a path. */
typedef struct {
    integer medium;  /* that the ray has come through */
    integer inside;  /* what is behind the surface */
    integer outside; /* and before it, where its shape says so */
} VertexMedia;

inline VertexMedia vertex_media(Scene scene, Slab path, Slab hit, uint at, mask active, integer row, mask front)
{
    VertexMedia m;
    m.inside = BSDF_INTERIOR(row);
    m.outside = 0;
#if USES_MEDIA && !BSDF_IS_PHASE
    ShapeMedia own = shape_media(scene, sel_i(active, load_hit_shape(hit, at), (integer)(0)));
    m.inside = sel_i(own.inside != 0, own.inside, m.inside);
    m.outside = own.outside;
#endif
    m.medium = medium_met(sel_i(active, load_path_medium(path, at), (integer)(0)), m.inside, front);
    return m;
}
