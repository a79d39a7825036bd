/* The watertight test of a ray and a triangle (Woop, Benthin and Wald 2013).
 *
 * Space is moved and sheared so that the ray runs along +z from the origin; then a triangle is hit if the origin
 * of the xy plane is on the same side of all its edges. Two triangles see the same two points
 * of a shared edge. Each product of the edge function is rounded by itself, and rounding keeps order:
 * a sign is never wrong, at worst the function is zero, which both sides take for inside.
 */
typedef struct {
    uint kx, ky, kz; /* axes: kz is the direction's largest */
    float x, y, z;   /* x' = x - shear.x * z, y' = y - shear.y * z, z' = shear.z * z */
    float ox, oy, oz; /* the origin, by the axes above */
} Shear;

inline Shear shear_make(float ox, float oy, float oz, float dx, float dy, float dz)
{
    float ax = fabs(dx), ay = fabs(dy), az = fabs(dz);
    Shear s;
    s.kz = az >= ax ? (az >= ay ? 2 : 1) : (ax >= ay ? 0 : 1);
    s.kx = s.kz == 2 ? 0 : s.kz + 1;
    s.ky = s.kx == 2 ? 0 : s.kx + 1;
    float d[3] = {dx, dy, dz}, o[3] = {ox, oy, oz};
    s.z = 1.0f / d[s.kz];
    s.x = d[s.kx] * s.z;
    s.y = d[s.ky] * s.z;
    s.ox = o[s.kx];
    s.oy = o[s.ky];
    s.oz = o[s.kz];
    return s;
}

inline float shear_edge(float px, float py, float qx, float qy)
{
#pragma OPENCL FP_CONTRACT OFF
    return px * qy - py * qx;
}

/* The body of a function that tests a triangle, see `shear_intersect`. */
#define SHEAR_INTERSECT                                                                               \
    float az = v[s->kz * step] - s->oz, bz = v[(3 + s->kz) * step] - s->oz;                           \
    float cz = v[(6 + s->kz) * step] - s->oz;                                                         \
    float ax = mad(-s->x, az, v[s->kx * step] - s->ox), ay = mad(-s->y, az, v[s->ky * step] - s->oy); \
    float bx = mad(-s->x, bz, v[(3 + s->kx) * step] - s->ox);                                         \
    float by = mad(-s->y, bz, v[(3 + s->ky) * step] - s->oy);                                         \
    float cx = mad(-s->x, cz, v[(6 + s->kx) * step] - s->ox);                                         \
    float cy = mad(-s->y, cz, v[(6 + s->ky) * step] - s->oy);                                         \
    float e0 = shear_edge(cx, cy, bx, by), e1 = shear_edge(ax, ay, cx, cy);                           \
    float e2 = shear_edge(bx, by, ax, ay), inverse = 1.0f / (e0 + e1 + e2);                           \
    *t = (e0 * az + e1 * bz + e2 * cz) * s->z * inverse;                                              \
    *b1 = e1 * inverse;                                                                               \
    *b2 = e2 * inverse;                                                                               \
    return (e0 >= 0.0f && e1 >= 0.0f && e2 >= 0.0f) || (e0 <= 0.0f && e1 <= 0.0f && e2 <= 0.0f);

/* Whether the ray's line hits a triangle with nine coordinates `step` floats apart; its distance, and the barycentrics
 * of vertices 1 and 2. */
inline int shear_intersect(const Shear *s, global const float *v, uint step, float *t, float *b1,
                           float *b2) { SHEAR_INTERSECT }
