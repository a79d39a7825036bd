/* The error of surface points in float32, and so the distance between a surface and the ends of its rays.
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

/* Hits of balls, tubes and disks are computed with twice a float's digits: the error of a point
 * hardly grows with the shape's size, but with the point's coordinates. */
#define EXACT_SIZE 0x1p-20f

/* The largest apparent distance of a point p on a primitive of this size from it [m]. Rays begin farther off. */
inline real beside_step(vec3 p, real size) { return 0.25f * rounding_step(p, size); }

/* Numbers as a float and its rounding error, exact to 2^-45: for differences of large numbers, such as from an eye to a
 * ball of a planet's size, which a single float would lose. Sums: Knuth 1969 (4.2.2, theorem B); products by `fma`; dot
 * products: Ogita, Rump and Oishi 2005 (Accurate Sum and Dot Product, algorithm 5.3). */
typedef struct { real high, low; } Twofold;
typedef struct { vec3 high, low; } Twofold3;

inline Twofold twofold_sum(real a, real b)
{
    real sum = a + b, from_b = sum - a;
    return (Twofold){sum, (a - (sum - from_b)) + (b - from_b)};
}

inline Twofold twofold_product(real a, real b)
{
    real product = a * b;
    return (Twofold){product, fma(a, b, -product)};
}

inline Twofold twofold_add(Twofold a, Twofold b)
{
    Twofold r = twofold_sum(a.high, b.high);
    r.low += a.low + b.low;
    return r;
}

inline Twofold twofold_neg(Twofold a) { Twofold r = {-a.high, -a.low}; return r; }

inline Twofold twofold_sqr(Twofold a)
{
    Twofold r = twofold_product(a.high, a.high);
    r.low += 2.0f * a.high * a.low;
    return r;
}

inline Twofold3 twofold_sub3(vec3 a, vec3 b)
{
    Twofold x = twofold_sum(a.x, -b.x), y = twofold_sum(a.y, -b.y), z = twofold_sum(a.z, -b.z);
    return (Twofold3){v3(x.high, y.high, z.high), v3(x.low, y.low, z.low)};
}

inline Twofold twofold_dot3(Twofold3 a, vec3 b)
{
    Twofold r = twofold_add(twofold_product(a.high.x, b.x), twofold_product(a.high.y, b.y));
    r = twofold_add(r, twofold_product(a.high.z, b.z));
    r.low += dot3(a.low, b);
    return r;
}

inline Twofold twofold_square3(Twofold3 a)
{
    Twofold r = twofold_dot3(a, a.high);
    r.low += dot3(a.low, a.high);
    return r;
}

inline real twofold_real(Twofold a) { return a.high + a.low; }
