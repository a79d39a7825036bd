/* The medium along w, which leads away from a vertex, and what a ray to a light begins in there. */
#include "path/vertex_dims.cl"

inline integer vertex_medium(Vertex v, vec3 w)
{
    return medium_beyond(v.media.medium, v.media.inside, v.media.outside, v.front, vertex_inward(v, w));
}
inline integer vertex_through(Vertex v, vec3 w) { return vertex_medium(v, w); }
