/* What shapes share that rays meet as they are, not as triangles. Lengths in metres. */

/* What float32 rounds when a ray's origin is put on a surface, relative to the coordinates. */
#define SURFACE_ROUNDING 3e-7f

inline real size3(vec3 a) { return max_r(max_r(fabs(a.x), fabs(a.y)), fabs(a.z)); }

/* The azimuth of (x, y) over 2 pi, in [0, 1). */
inline real turn_of(real y, real x)
{
    real turn = atan2_r(y, x) * INV_2PI;
    return turn + sel(turn < 0.0f, (real)(1.0f), (real)(0.0f));
}
