/* Trees over triangles with moving vertices. Copies of a node or leaf for consecutive keys are neighbours; a traversal
 * gets `nodes` and `leaves` at the key before the time, and the fraction of the step to the next key. Products are
 * rounded separately, and rounding keeps order: points inside a box at both keys are inside between them. */
#ifdef FP_FAST_FMAF
#define KEYED_BETWEEN(a, b, share) fma(b, share, a * (1.0f - share))
#else
#define KEYED_BETWEEN(a, b, share) (a * (1.0f - share) + b * share)
#endif

inline float keyed_one(float a, float b, float share)
{
#pragma OPENCL FP_CONTRACT OFF
    return KEYED_BETWEEN(a, b, share);
}

inline float8 keyed_row(float8 a, float8 b, float share)
{
#pragma OPENCL FP_CONTRACT OFF
    return KEYED_BETWEEN(a, b, (float8)(share));
}

/* A triangle's nine coordinates, `step` floats apart, interpolated with the next key `next` floats farther. */
inline void keyed_corners(global const float *v, uint step, uint next, float share, float corners[9])
{
    for (uint i = 0; i < 9; i++) corners[i] = keyed_one(v[i * step], v[i * step + next], share);
}

/* A hit of the triangle of these corners. */
inline TriHit keyed_hit(const float c[9], float t, float u, float v, uint prim, uint tag)
{
    float3 v0 = (float3)(c[0], c[1], c[2]);
    return tri_hit(t, u, v, prim, tag, v0, (float3)(c[3], c[4], c[5]) - v0, (float3)(c[6], c[7], c[8]) - v0);
}

/* Like shear_intersect, for corners in registers. */
inline int keyed_intersect(const Shear *s, const float v[9], uint step, float *t, float *b1, float *b2)
{
    SHEAR_INTERSECT
}

/* Replaces the hit if the triangle of a record is nearer; its corners are consecutive. names: the position of number
 * and tag in the record; size: of a record [floats]. */
inline int keyed_nearer(const Shear *shear, global const float *record, uint names, uint size, float share, float tmin,
                        TriHit *hit)
{
    float corners[9], t, u, v;
    keyed_corners(record, 1, size, share, corners);
    if (!keyed_intersect(shear, corners, 1, &t, &u, &v) || !(t > tmin && t < hit->t)) return 0;
    *hit = keyed_hit(corners, t, u, v, as_uint(record[names]), as_uint(record[names + 1]));
    return 1;
}
