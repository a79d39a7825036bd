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
inline Spectrum vertex_arriving(Scene scene, Slab path, uint at, mask active, Vertex v) { return v.beta; }
inline Spectrum vertex_beyond(Scene scene, Vertex v, vec3 w, real t, Wavelengths lambdas,
                              Spectrum value) { return value; }
inline integer vertex_medium(Vertex v, vec3 w) { return (integer)(0); }
inline integer vertex_around(Vertex v, vec3 w) { return (integer)(0); }
inline integer vertex_through(Vertex v, vec3 w) { return (integer)(0); }
