/* Trees over triangles that change with time. Nodes and leaves stand there once for each key, side by side; a
 * traversal gets `nodes` and `leaves` at the key before the time, and the share of the way to the next one.
 * Products are rounded by themselves, and rounding keeps order: what is inside of a box at both keys is in between. */
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

/* The nine coordinates of a triangle that stand `step` floats apart, those of the next key `next` floats farther. */
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

/* As shear_intersect, of corners that stand here. */
inline int keyed_intersect(const Shear *s, const float v[9], uint step, float *t, float *b1, float *b2)
{
    SHEAR_INTERSECT
}

/* Takes the triangle of a record, whose corners stand in a row, as the hit if it is met before that. names: where in
 * the record its number and tag are; size: of a record [floats]. */
inline int keyed_nearer(const Shear *shear, global const float *record, uint names, uint size, float share, float tmin,
                        TriHit *hit)
{
    float corners[9], t, u, v;
    keyed_corners(record, 1, size, share, corners);
    if (!keyed_intersect(shear, corners, 1, &t, &u, &v) || !(t > tmin && t < hit->t)) return 0;
    *hit = keyed_hit(corners, t, u, v, as_uint(record[names]), as_uint(record[names + 1]));
    return 1;
}
