/* The medium along w, which leads away from a vertex, and what a ray to a light begins in there. */
#include "media/vertex_dims.cl"

inline integer vertex_medium(Vertex v, vec3 w)
{
    return medium_beyond(v.media.medium, v.media.inside, v.media.outside, v.front, vertex_inward(v, w));
}
/* What a path along w remembers: the medium from which it has gone into a body that absorbs by itself. */
inline integer vertex_around(Vertex v, vec3 w)
{
    mask enters = v.media.absorbs & v.front & vertex_inward(v, w), leaves = v.media.absorbs & !vertex_inward(v, w);
    return sel_i(enters, v.media.medium, sel_i(leaves & !v.front, (integer)(0), v.media.around));
}
inline integer vertex_through(Vertex v, vec3 w) { return vertex_medium(v, w); }

/* Twin, where there are no media. */
#define vertex_arriving(scene, path, at, active, v) ((v).beta)
#define vertex_beyond(scene, v, w, t, lambdas, value) (value)
