/* The media around a vertex of a path. */
typedef struct {
    integer medium;  /* incident: the ray travelled in it */
    integer inside;  /* interior: behind the surface, 0 for none */
    integer outside; /* exterior: named by the shape, else `around` for an absorbing dielectric, 0 for none */
    integer around;  /* stored in the path: the medium around the absorbing dielectric that the path is in */
    mask absorbs;    /* the surface is of an absorbing dielectric that names no media */
} VertexMedia;

/* Step. */

inline VertexMedia vertex_media(Scene scene, Slab path, Slab hit, uint at, mask active, integer row, mask front)
{
    VertexMedia m;
    m.inside = medium_that_absorbs(scene, BSDF_INTERIOR(row));
    m.absorbs = m.inside != 0;
    m.around = sel_i(active, load_path_around(path, at), (integer)(0));
    m.outside = sel_i(m.absorbs, m.around, (integer)(0));
#if USES_MEDIA && !BSDF_IS_PHASE
    ShapeMedia own = shape_media(scene, sel_i(active, load_hit_shape(hit, at), (integer)(0)));
    m.inside = sel_i(own.inside != 0, own.inside, m.inside);
    m.absorbs = m.absorbs & (own.inside == 0) & (own.outside == 0);
    m.outside = sel_i(m.absorbs, m.around, own.outside);
#endif
    m.medium = medium_met(sel_i(active, load_path_medium(path, at), (integer)(0)), m.inside, front);
    return m;
}

/* Twin, for scenes without media. */
inline VertexMedia vertex_media(Scene scene, Slab path, Slab hit, uint at, mask active, integer row, mask front)
{
    return (VertexMedia){0, 0, 0, 0, mask_of(0)};
}
