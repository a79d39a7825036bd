/* The medium along a direction w away from a vertex, where a shadow ray along w begins. */
#include "media/vertex_dims.cl"

inline integer vertex_medium(Vertex v, vec3 w)
{
    return medium_beyond(v.media.medium, v.media.inside, v.media.outside, v.front, vertex_inward(v, w));
}
/* `around` of a path that goes on along w: the medium outside of the absorbing dielectric that it enters or stays
 * in. */
inline integer vertex_around(Vertex v, vec3 w)
{
    mask enters = v.media.absorbs & v.front & vertex_inward(v, w), leaves = v.media.absorbs & !vertex_inward(v, w);
    return sel_i(enters, v.media.medium, sel_i(leaves & !v.front, (integer)(0), v.media.around));
}
inline integer vertex_through(Vertex v, vec3 w) { return vertex_medium(v, w); }

/* Twin, for scenes without media. */
#define vertex_arriving(scene, path, at, active, v) ((v).beta)
#define vertex_beyond(scene, v, w, t, lambdas, value) (value)
