/* The shading frame of a surface, perturbed by a normal map (Cohen et al. 1998) or a bump map (Blinn 1978) of its
 * material. NORMAL_MAP_WORDS words before a material's row describe them: flags, the scale of the normal map, the
 * scale of the bump map, then reals of two words each: x, y and z of the normal, 0 to 1,
 * and the height; then `to_uv` of shapes/surface_point.cl, four words each, of the normal map, of a coat's normals and
 * of directions of anisotropy. normal_map_real is generated.
 *
 * A normal that faces away from the viewer is turned about the normal of the surface (Schuessler et al. 2017).
 * The edge where a perturbed surface turns dark is softened as Estevez et al. 2019 do, "A Microfacet-Based
 * Shadowing Function to Solve the Bump Terminator Problem". Both as Mitsuba 3 has them. */
#define PERTURB_INSIDE 1     /* of a two-sided material, rather than around it */
#define PERTURB_ALONG_V 2    /* y of the normal goes along v even where uv is mirrored */
#define PERTURB_AS_IT_IS 4   /* even a normal that faces away from the viewer */
#define PERTURB_UNSHADED 8   /* the edge is not softened */
#define PERTURB_NORMAL 16    /* there is a normal map */
#define PERTURB_HEIGHT 32    /* there is a bump map */
#define PERTURB_SECOND 64    /* the normal map is on a mesh's second uv; twice and four times that: the other two */
#define PERTURB_TURNS 11     /* first of the words `to_uv` */
#define PERTURB_STEP 1e-4f   /* of uv, over which heights are compared */

typedef struct {
    Frame frame;
    Frame base;  /* of the surface itself */
    real alpha2; /* roughness of the softened edge, squared */
} ShadingFrame;

inline real perturbed_height(Scene scene, integer at, TexturePoint point, Surface s, real u, real v,
                             Wavelengths lambdas)
{
    point.uv.x += u;
    point.uv.y += v;
    point.p = madd3(s.dpdu, u, madd3(s.dpdv, v, point.p));
    surface_attributes_move(s, u, v, &point);
    return normal_map_real(scene, at, point, lambdas);
}

/* The frame of the normal map (which: 0), of a coat's normals (1), or of directions of anisotropy (2). */
inline MapFrame shading_map_frame(Scene scene, integer row, Surface s, Frame base, int which)
{
    integer at = max_i(row - NORMAL_MAP_WORDS, (integer)(0)), flags = gather_i(scene.materials, at);
    mask second = (flags & (PERTURB_SECOND << which)) != 0;
    return map_frame_of(s, base, second, row4(scene.materials, at + PERTURB_TURNS + 4 * which));
}

inline ShadingFrame shading_frame_load(Scene scene, integer row, Surface s, vec3 d, Wavelengths lambdas)
{
    ShadingFrame f;
    f.base = surface_frame(s);
    TexturePoint point = surface_texture_point(s);
    integer at = max_i(row - NORMAL_MAP_WORDS, (integer)(0)), flags = gather_i(scene.materials, at);
    vec3 n = v3(0.0f, 0.0f, 1.0f);
    mask inside = (flags & PERTURB_INSIDE) != 0;
    mask bumpy = (flags & PERTURB_HEIGHT) != 0;
    if (any(bumpy)) {
        real h = perturbed_height(scene, at + 9, point, s, (real)(0.0f), (real)(0.0f), lambdas);
        real hu = perturbed_height(scene, at + 9, point, s, (real)(PERTURB_STEP), (real)(0.0f), lambdas);
        real hv = perturbed_height(scene, at + 9, point, s, (real)(0.0f), (real)(PERTURB_STEP), lambdas);
        real slope = gather_w(scene.materials, at + 2) * (1.0f / PERTURB_STEP);
        /* Seen from behind, bumps are dents; a map inside of a two-sided material rises on both sides. */
        slope = sel(s.flipped & !inside, -slope, slope);
        vec3 u = madd3(s.ns, (hu - h) * slope - dot3(s.ns, s.dpdu), s.dpdu);
        vec3 v = madd3(s.ns, (hv - h) * slope - dot3(s.ns, s.dpdv), s.dpdv);
        vec3 across = to_frame(f.base, cross3(u, v));
        mask usable = bumpy & (fabs(across.z) > 1e-20f);
        n = sel3(usable, scale3(across, sel(across.z < 0.0f, (real)(-1.0f), (real)(1.0f))), n);
    }
    mask mapped = (flags & PERTURB_NORMAL) != 0;
    if (any(mapped)) {
        real scale = gather_w(scene.materials, at + 1) * 2.0f;
        real x = (normal_map_real(scene, at + 3, point, lambdas) - 0.5f) * scale;
        real y = (normal_map_real(scene, at + 5, point, lambdas) - 0.5f) * scale;
        real z = normal_map_real(scene, at + 7, point, lambdas) * 2.0f - 1.0f;
        x = sel(s.flipped & !inside, -x, x);
        y = sel(s.flipped & inside, -y, y);
        MapFrame own = shading_map_frame(scene, row, s, f.base, 0);
        mask by_v = (flags & PERTURB_ALONG_V) != 0, turned = by_v | ((flags & PERTURB_SECOND) != 0);
        /* Mitsuba's y is at the left of u, whatever v is along; on a back the frame's own sides are exchanged. */
        own.side = sel(by_v, sel(s.flipped, -own.side, own.side), (real)(1.0f));
        own.c = sel(turned, own.c, (real)(1.0f));
        own.s = sel(turned, own.s, (real)(0.0f));
        vec3 m = map_frame_vector(own, v3(x, y, z));
        n = sel3(mapped & (dot3(m, m) > 1e-12f), m, n);
    }
    vec3 wo = to_frame(f.base, neg3(d));
    mask away = (wo.z * dot3(wo, n) <= 0.0f) & ((flags & PERTURB_AS_IT_IS) == 0);
    n = normalize3(v3(sel(away, -n.x, n.x), sel(away, -n.y, n.y), n.z));
    vec3 along = normalize3(v3(1.0f - n.x * n.x, -n.x * n.y, -n.x * n.z));
    f.frame.n = to_world(f.base, n);
    f.frame.s = to_world(f.base, along);
    f.frame.t = cross3(f.frame.n, f.frame.s);
    real tan2 = 1.0f / max_r(n.z * n.z, (real)(1e-12f)) - 1.0f;
    f.alpha2 = sel((flags & PERTURB_UNSHADED) != 0, (real)(0.0f), clamp_r(0.125f * tan2, (real)(0.0f), (real)(1.0f)));
    return f;
}

/* Whether the frame of a material at `row` depends on where the ray comes from. */
inline mask shading_frame_turns(Scene scene, integer row)
{
    integer flags = gather_i(scene.materials, max_i(row - NORMAL_MAP_WORDS, (integer)(0)));
    return (flags & (PERTURB_NORMAL | PERTURB_HEIGHT)) != 0;
}

/* The factor of light toward or from `w`: 0 where the perturbed
 * and the true surface disagree on the side. */
inline real shading_frame_share(ShadingFrame f, vec3 w)
{
    real z = dot3(f.base.n, w), perturbed = dot3(f.frame.n, w);
    real tan2 = 1.0f / max_r(z * z, (real)(1e-12f)) - 1.0f;
    real share = 2.0f / (1.0f + sqrt(1.0f + f.alpha2 * max_r(tan2, (real)(0.0f))));
    return sel(z * perturbed > 0.0f, share, (real)(0.0f));
}

/* Twin, where no map perturbs normals. */
typedef struct { Frame frame; } ShadingFrame;

inline ShadingFrame shading_frame_load(Scene scene, integer row, Surface s, vec3 d, Wavelengths lambdas)
{
    return (ShadingFrame){surface_frame(s)};
}
/* The frame of a coat's normals (which: 1) or of directions of anisotropy (2). */
inline MapFrame shading_map_frame(Scene scene, integer row, Surface s, Frame base, int which)
{
    vec4 plain = {1.0f, 0.0f, 0.0f, 1.0f};
    return map_frame_of(s, base, mask_of(0), plain);
}
inline mask shading_frame_turns(Scene scene, integer row) { return mask_of(0); }
inline real shading_frame_share(ShadingFrame f, vec3 w) { return 1.0f; }

/* Step anisotropy: a material that is rougher along a direction, which is told beside u and v of a map. */
/* The material, whose direction is counted in the frame where it is shaded, from the first axis to the second. The
 * material tells it on the surface itself, from u to v, which is the other way round where uv are mirrored, and on a
 * back. */
inline Bsdf anisotropy_turned(Scene scene, integer row, Bsdf m, Surface s, Frame shaded)
{
    Frame base = surface_frame(s);
    MapFrame own = shading_map_frame(scene, row, s, base, 2);
    real sine, cosine, turns = m.anisotropy_rotation * (1.0f / 360.0f);
    sincos_2pi(turns - floor(turns), &sine, &cosine);
    vec3 along = to_world(base, map_frame_vector(own, v3(cosine, sine, (real)(0.0f))));
    m.anisotropy_rotation = 360.0f * INV_2PI * atan2_r(dot3(along, shaded.t), dot3(along, shaded.s));
    return m;
}

/* Twin, where a material is equally rough in all directions, or knows no turn. */
inline Bsdf anisotropy_turned(Scene scene, integer row, Bsdf m, Surface s, Frame shaded) { return m; }

/* Step coat_normal: a coat whose normal is told by a map of its own. */
/* The material, whose coat's normal is told by u and v of its map and the surface's normal, in the frame where it is
 * shaded. */
inline Bsdf coat_normal_turned(Scene scene, integer row, Bsdf m, Surface s, Frame shaded)
{
    Frame base = surface_frame(s);
    real scale = m.clearcoat_normal_scale, x = (2.0f * m.clearcoat_normal_x - 1.0f) * scale;
    real y = (2.0f * m.clearcoat_normal_y - 1.0f) * scale;
    MapFrame own = shading_map_frame(scene, row, s, base, 1);
    vec3 n = map_frame_vector(own, v3(x, y, 2.0f * m.clearcoat_normal_z - 1.0f));
    n = to_frame(shaded, to_world(base, normalize3(n)));
    m.clearcoat_normal_x = 0.5f * n.x + 0.5f;
    m.clearcoat_normal_y = 0.5f * n.y + 0.5f;
    m.clearcoat_normal_z = 0.5f * n.z + 0.5f;
    m.clearcoat_normal_scale = 1.0f;
    return m;
}

/* Twin, where a material has no coat with a normal of its own. */
inline Bsdf coat_normal_turned(Scene scene, integer row, Bsdf m, Surface s, Frame shaded) { return m; }
