/* The contract of a shape kind: kernels/shapes/kinds/<kind>.cl has, where <Kind> is a Record in
 * clpt/geometry/shapes.py whose rows lie in `geometry`,
 *
 *   ShapeSample <kind>_sample(<Kind> s, vec3 p, vec2 u);      a point of the shape, as seen from p
 *   real        <kind>_pdf(<Kind> s, vec3 p, vec3 wi, real t, vec3 n);   of sample [1/sr], for a hit at distance t
 *                                                                         with unit normal n
 *
 * and, for shapes that rays meet as they are (not as triangles),
 *
 *   ShapeHit    <kind>_intersect(<Kind> s, vec3 o, vec3 d, real tmin, real tmax);    nearest hit in (tmin, tmax)
 *   vec3        <kind>_onto(<Kind> s, vec3 p);                                       nearest point, for p close to it
 *   real        <kind>_size(<Kind> s);                                               see core/rounding.cl [m]
 *   vec3        <kind>_dpdu(<Kind> s, vec3 p, vec2 uv);                              tangent at a point of it
 *   vec3        <kind>_dpdv(<Kind> s, vec3 p, vec2 uv);                              and along v
 *
 * Normals point to the front, outward for closed shapes. ShapeSample is declared beside the kinds. */
#include "generated/shape_sample.cl"

typedef struct {
    real t; /* [m]; FAR: missed */
    vec3 n; /* unit normal, toward the front */
    vec2 uv;
} ShapeHit;
