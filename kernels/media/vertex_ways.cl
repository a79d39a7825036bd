/* The media along the directions away from a vertex. */

/* Step dims: the throughput that arrives at a vertex, after the transmittance of the incident medium. */
inline Spectrum vertex_arriving(Scene scene, Slab path, uint at, mask active, Vertex v)
{
    real through = v.t + sel(active, load_path_ray_offset(path, at), (real)(0.0f));
    Spectrum left = medium_transmittance(scene, medium_left(v.media.medium), through, v.lambdas);
    return spectrum_mul(v.beta, left);
}

/* Whether w leads to the interior of the shape: the normal of a two-sided shape is turned to the viewer. */
inline mask vertex_inward(Vertex v, vec3 w)
{
    mask crosses = dot3(v.s.n, w) * dot3(v.s.n, v.d) > 0.0f;
    return sel_i(crosses, v.front, !v.front);
}

/* `value` times the transmittance of t metres along w away from the vertex. */
inline integer vertex_medium(Vertex v, vec3 w);
inline Spectrum vertex_beyond(Scene scene, Vertex v, vec3 w, real t, Wavelengths lambdas, Spectrum value)
{
    return medium_dims(scene, vertex_medium(v, w), t, lambdas, value);
}

/* Step media: the medium along a direction w away from a vertex, where a shadow ray along w begins. */
#include "media/vertex_ways.cl#dims"

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

/* Step bodies: the medium along a direction w away from a vertex, and the bodies where a shadow ray along w begins. */
#include "media/vertex_ways.cl#dims"

inline integer vertex_medium(Vertex v, vec3 w) { return sel_i(vertex_inward(v, w), v.media.inside, v.media.outside); }
inline integer vertex_through(Vertex v, vec3 w) { return bodies_beyond(v.media.bodies, vertex_inward(v, w)); }
