/* What the x and y of a map are along, beside the frame in which its surface is shaded: they lie in the plane of both,
 * and are told by a unit vector and a side. */
typedef struct {
    real c, s; /* x of the map in that frame */
    real side; /* 1 where y is at x's left there, -1 where uv are mirrored */
} MapFrame;

inline MapFrame map_frame_plain(void) { MapFrame m = {(real)(1.0f), (real)(0.0f), (real)(1.0f)}; return m; }

/* Along the map's own u and v. second: these are a mesh's second set; to_uv: how the surface's u and v make up those of
 * the map, as coordinates of these: x and y of u, z and w of v. Tangents that a mesh tells hold as they are. */
inline MapFrame map_frame_of(Surface s, Frame base, mask second, vec4 to_uv)
{
    vec3 u = sel3(second, s.along1, s.along), v = sel3(second, s.beside1, s.beside);
    vec3 along = sel3(s.told, u, madd3(u, to_uv.x, scale3(v, to_uv.y)));
    vec3 beside = sel3(s.told, v, madd3(u, to_uv.z, scale3(v, to_uv.w)));
    real x = dot3(along, base.s), y = dot3(along, base.t), length2 = x * x + y * y;
    mask given = length2 > 1e-30f;
    real inverse = 1.0f / sqrt(sel(given, length2, (real)(1.0f)));
    MapFrame m;
    m.c = sel(given, x * inverse, (real)(1.0f));
    m.s = sel(given, y * inverse, (real)(0.0f));
    m.side = sel(m.c * dot3(beside, base.t) < m.s * dot3(beside, base.s), (real)(-1.0f), (real)(1.0f));
    return m;
}

/* A vector that a map tells, in the frame of the surface. */
inline vec3 map_frame_vector(MapFrame m, vec3 n)
{
    real y = n.y * m.side;
    return v3(m.c * n.x - m.s * y, m.s * n.x + m.c * y, n.z);
}
