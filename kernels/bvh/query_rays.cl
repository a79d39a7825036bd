/* An application's rays as arguments of a kernel, a ray a work-item.
 *
 * Origins and directions are x y z, packed; t is in units of the direction. `t_mins` and `t_maxs` are null if a
 * number holds for all rays. `begins` are offsets of arrays in their buffers, in elements: origins, directions,
 * t_mins, t_maxs, then outputs.
 */
#define RAY_ARGS uint count, uint8 begins, global const float *origins, global const float *directions, \
                 global const float *t_mins, global const float *t_maxs, float t_min, float t_max

/* Ray i as o[0..2], d[0..2], from, to; 3 i needs more than 32 bits from 1.4 billion rays on. */
#define QUERY_RAY(i)                                                                            \
    size_t ray_at = 3 * (size_t)(i);                                                            \
    global const float *o = origins + begins.s0 + ray_at, *d = directions + begins.s1 + ray_at; \
    float from = t_mins ? t_mins[begins.s2 + i] : t_min, to = t_maxs ? t_maxs[begins.s3 + i] : t_max;
#define QUERY_ONE o[0], o[1], o[2], d[0], d[1], d[2], from, to
