/* Whether a ray passes beside a piece of a curve: all control points are farther to the same side than its radius. Most
 * pieces with hit boxes are rejected here, four points at a time. `piece`: its words, see
 * kernels/shapes/kinds/curves.cl. */
inline int curve_beside(global const float *piece, float3 o, float3 d)
{
    float4 x = vload4(0, piece) - o.x, y = vload4(1, piece) - o.y, z = vload4(2, piece) - o.z;
    float4 r = fabs(vload4(3, piece));
    float3 chord = (float3)(x.w - x.x, y.w - y.x, z.w - z.x);
    float nx = chord.y * d.z - chord.z * d.y, ny = chord.z * d.x - chord.x * d.z, nz = chord.x * d.y - chord.y * d.x;
    float4 w = x * nx + y * ny + z * nz, away = fabs(x) + fabs(y) + fabs(z);
    float2 half_reach = fmax(r.lo, r.hi), half_away = fmax(away.lo, away.hi);
    float reach = fmax(half_reach.x, half_reach.y) + 1e-6f * fmax(half_away.x, half_away.y); /* and rounding errors */
    float limit = reach * reach * (nx * nx + ny * ny + nz * nz);
    return all((w * w > limit) & (w > 0.0f)) || all((w * w > limit) & (w < 0.0f));
}

/* The same for tracing with a ray a work-item; in lanes the test is skipped. */
#if LANES == 1
#define curve_beside_one(piece, o, d) curve_beside(piece, (float3)(o.x, o.y, o.z), (float3)(d.x, d.y, d.z))
#else
#define curve_beside_one(piece, o, d) 0
#endif
