/* The medium along a direction w away from a vertex, and the bodies where a shadow ray along w begins. */
#include "media/vertex_dims.cl"

inline integer vertex_medium(Vertex v, vec3 w) { return sel_i(vertex_inward(v, w), v.media.inside, v.media.outside); }
inline integer vertex_through(Vertex v, vec3 w) { return bodies_beyond(v.media.bodies, vertex_inward(v, w)); }
