/* A point of a surface, with the members that follow from the hit alone. */
typedef struct {
    vec3 p;       /* on it, but for the rounding of p itself [m] */
    real size;    /* of the primitive [m], see core/rounding.cl */
    vec3 n;       /* geometric normal, unit length, on the side of the front */
    vec3 ns;      /* shading normal, unit length */
    vec3 dpdu;    /* how p moves with the surface's u; may be zero */
    vec3 dpdv;    /* and with v */
    vec3 along;   /* direction of maps and frames: dpdu, or the mesh's tangent; of any length */
    vec3 beside;  /* likewise dpdv, or the bitangent */
    vec3 along1;  /* the same for the mesh's second set of uv */
    vec3 beside1;
    mask told;    /* the mesh has tangents, which hold for all sets of uv */
    vec2 uv;
    mask flipped; /* the back of a two-sided surface was hit, and ns negated */
    integer light; /* row in `lights`, -1: does not emit */
    integer attributes, face; /* of triangles, see textures/texture_point.cl */
    vec2 b, dbdu, dbdv; /* dbdu, dbdv: how b moves with the surface's uv */
    real footprint; /* of the path's cone, see textures/texture_point.cl */
    vec3 to_open, to_close; /* from p to the same point of a deforming shape when the shutter opens, closes [m] */
} Surface;

/* A point of a medium, as a surface without extent: it has no normal. */
inline Surface surface_of_point(vec3 p)
{
    Surface s = {p}; /* all else is 0 */
    s.light = -1;
    return s;
}

/* The point where the ray from `o` along `d` ends, on a flat triangle. */
inline Surface surface_met(TraceHit h, mask active, vec3 o, vec3 d)
{
    Surface s = surface_of_point(o);
    vec3 n = sel3(active, h.n, v3(0.0f, 0.0f, 1.0f));
    real inverse = 1.0f / wide_length3(n);
    s.n = scale3(n, inverse);
    s.size = triangle_size(h.side, inverse);
    /* The ray's roundings grow with its length. They may have put its end behind the surface, so that it is put back
     * on it, or behind a neighbour, so that it goes back along the ray first, but not behind its beginning. */
    s.p = madd3(d, max_r(h.t - 2.0f * rounding_step(o, h.t), 0.5f * h.t), o);
    s.p = madd3(s.n, h.plane * inverse - dot3(s.n, s.p), s.p);
    s.ns = s.n;
    s.uv.x = h.u;
    s.uv.y = h.v;
    return s;
}

/* The row in `lights` of a primitive, -1 if it does not emit. */
inline integer surface_light(ShapeRow shape, integer prim, mask active)
{
    mask emits = active & (shape.light >= 0);
    integer light = -1;
    if (any(emits)) {
        integer offset = sel_i((shape.flags & SHAPE_ONE_LIGHT) != 0, (integer)(0), prim - shape.prim);
        light = sel_i(emits, shape.light + offset, (integer)(-1));
    }
    return light;
}

/* The surface as a viewer along d sees it. Each normal is flipped by itself: if they disagree, as at the silhouette of
 * a coarse mesh, a BSDF that saw its back would be black. */
inline Surface surface_turned(Surface s, ShapeRow shape, mask front, vec3 d)
{
    mask both = (shape.flags & SHAPE_TWO_SIDED) != 0;
    s.flipped = both & (dot3(s.ns, d) > 0.0f);
    s.n = sel3(both & !front, neg3(s.n), s.n);
    s.ns = sel3(s.flipped, neg3(s.ns), s.ns);
    return s;
}

/* The axes of a map relative to the shading frame: they lie in the plane of s and t, as a unit vector and a side. */
typedef struct {
    real c, s; /* x of the map in the shading frame */
    real side; /* 1 if y is to the left of x, -1 if uv are mirrored */
} MapFrame;

inline MapFrame map_frame_plain(void) { MapFrame m = {(real)(1.0f), (real)(0.0f), (real)(1.0f)}; return m; }

/* The axes along the map's own u and v. second: these are the mesh's second set of uv; to_uv: the map's u (x, y) and v
 * (z, w) in coordinates of the surface's u and v. Tangents of a mesh hold as they are. */
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

/* A vector of a map, in the shading frame. */
inline vec3 map_frame_vector(MapFrame m, vec3 n)
{
    real y = n.y * m.side;
    return v3(m.c * n.x - m.s * y, m.s * n.x + m.c * y, n.z);
}
