/* How far float32 may put a point off the surface that it lies on, and so how far off it a ray begins and ends.
 *
 * A point of a surface is rounded in proportion to its coordinates; the distance at which a ray meets a primitive in
 * proportion to the primitive's size. Measured over random triangles near the origin and far from it, thin ones too:
 * with 6 * 2^-24 of both, one ray of a million that leaves a triangle meets it again; with 8, none. (The idea: Waechter
 * and Binder 2019, Ray Tracing Gems 6.) */
#define SURFACE_ROUNDING 0x1p-21f
#define SHADOW_SHORTER 0.999999f /* a shadow ray ends by some roundings before a light that has no size */
#define THINNEST 1e3f /* side^2 over twice the area from which on thin triangles count no more */

inline real size3(vec3 a) { return max_r(max_r(fabs(a.x), fabs(a.y)), fabs(a.z)); }

/* How large a triangle counts [m]: more the thinner it is, because the plane of a thin one is known less well. side:
 * greatest coordinate of its sides [m]; inverse: 1 / (twice its area) [1/m^2]. */
inline real triangle_size(real side, real inverse)
{
    return side * clamp_r(side * side * inverse, (real)(1.0f), (real)(THINNEST));
}

/* The least distance to keep from a primitive of this size at p [m]. */
inline real rounding_step(vec3 p, real size) { return SURFACE_ROUNDING * (size3(p) + size); }

/* Balls, tubes and disks are met, and their points put onto them, with heights of twice a float's digits
 * (core/twofold.cl): what a point is off them hardly grows with their size, but with its own coordinates. */
#define EXACT_SIZE 0x1p-20f

/* How far beside a primitive of this size a point at p may seem to be that lies on it [m]. Rays begin farther off. */
inline real beside_step(vec3 p, real size) { return 0.25f * rounding_step(p, size); }
