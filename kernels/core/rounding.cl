/* The error of surface points in float32, and so the distance from the surface at which rays begin and end.
 *
 * The rounding error of a surface point is proportional to its coordinates; the error of a hit distance is
 * proportional to the primitive's size. Measured over random triangles, near and far from the origin and thin: with
 * 6 * 2^-24 of both, a ray in a million that leaves a triangle hits it again; with 8, none. (The idea: Waechter
 * and Binder 2019, Ray Tracing Gems 6.) */
#define SURFACE_ROUNDING 0x1p-21f
#define SHADOW_SHORTER 0.999999f /* a shadow ray ends some roundings before a point light */
#define THINNEST 1e3f /* limit of side^2 over twice the area for thin triangles */

inline real size3(vec3 a) { return max_r(max_r(fabs(a.x), fabs(a.y)), fabs(a.z)); }

/* The effective size of a triangle [m]: larger for thin triangles, whose planes are less exact. side: greatest
 * coordinate of its sides [m]; inverse: 1 / (twice its area) [1/m^2]. */
inline real triangle_size(real side, real inverse)
{
    return side * clamp_r(side * side * inverse, (real)(1.0f), (real)(THINNEST));
}

/* The least distance to keep from a primitive of this size at p [m]. */
inline real rounding_step(vec3 p, real size) { return SURFACE_ROUNDING * (size3(p) + size); }

/* Hits of balls, tubes and disks are computed with twice a float's digits (core/twofold.cl): the error of a point
 * hardly grows with the shape's size, but with the point's coordinates. */
#define EXACT_SIZE 0x1p-20f

/* The largest apparent distance of a point p on a primitive of this size from it [m]. Rays begin farther off. */
inline real beside_step(vec3 p, real size) { return 0.25f * rounding_step(p, size); }
