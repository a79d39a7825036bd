/* Lights on shapes. */

/* The sample ends before the surface by more than rounding, else the surface would occlude it. p: the point [m]. */
inline LightSample area_sample(ShapeSample q, vec3 p, Spectrum radiance)
{
    real cosine = -dot3(q.n, q.wi);
    mask front = cosine > 0.0f;
    LightSample s;
    s.wi = q.wi;
    s.t = max_r(q.t - rounding_step(p, q.size + q.t) / max_r(cosine, (real)(1e-6f)), 0.5f * q.t);
    s.radiance = spectrum_sel(front, radiance, spectrum_of(0.0f));
    s.pdf = sel(front, q.pdf, (real)(0.0f));
    s.n = q.n;
    return s;
}

/* The texture point at uv of the sphere of a row of `lights`, without the point in the world. */
inline TexturePoint area_sphere_point(Scene scene, ShapeRow shape, integer row, vec2 uv)
{
    TexturePoint t = texture_point(uv, v3(0.0f, 0.0f, 0.0f));
#if USES_ATTRIBUTES
    mask many = (shape.flags & SHAPE_MANY) != 0;
    t.attributes = shape.attributes;
    t.face = sel_i(many, texture_face_of_sphere(shape.prim + row - shape.light - scene.settings->single_count),
                   (integer)(0));
#endif
    return t;
}

/* The texture point at barycentrics b of the triangle of a row of `lights`, without the point in the world. uv are the
 * mesh's, or the barycentrics in a mesh without uv. */
inline TexturePoint area_triangle_point(Scene scene, ShapeRow shape, integer row, vec2 b)
{
    integer face = shape.prim + row - shape.light, corner = 3 * face;
    vec3 corners = gather3((global const float *)scene.faces, corner);
    vec2 uv0 = gather2(scene.uvs, 2 * as_integer(corners.x)), uv1 = gather2(scene.uvs, 2 * as_integer(corners.y));
    vec2 uv2 = gather2(scene.uvs, 2 * as_integer(corners.z));
    mask mapped = (shape.flags & SHAPE_UVS) != 0;
    real b0 = 1.0f - b.x - b.y;
    vec2 uv;
    uv.x = sel(mapped, uv0.x * b0 + uv1.x * b.x + uv2.x * b.y, b.x);
    uv.y = sel(mapped, uv0.y * b0 + uv1.y * b.x + uv2.y * b.y, b.y);
    TexturePoint t = texture_point(uv, v3(0.0f, 0.0f, 0.0f));
#if USES_ATTRIBUTES
    t.attributes = shape.attributes;
    t.face = face;
    t.b = b;
#endif
    return t;
}

/* Step two_sided: the normal of a light that emits from both sides faces p. */
inline ShapeSample area_turned(ShapeSample q, LightRow l)
{
    q.n = sel3(light_mode(l, EMISSION_BOTH) & (dot3(q.n, q.wi) > 0.0f), neg3(q.n), q.n);
    return q;
}

/* Twin, where all lights on shapes have a single side. */
inline ShapeSample area_turned(ShapeSample q, LightRow l) { return q; }

/* Step unseen: a sample of a light that no ray sees has weight 1, like a sample of a delta light: its density is
 * negated. */
inline LightSample area_unseen(LightSample s, LightRow l)
{
    mask unseen = light_mode(l, EMISSION_UNSEEN);
    s.chance = sel(unseen, fabs(s.pdf), s.chance);
    s.pdf = sel(unseen, -s.pdf, s.pdf);
    return s;
}

/* Twin, where rays see all lights on shapes. */
inline LightSample area_unseen(LightSample s, LightRow l) { return s; }

/* Step directed: the point that an emission looks up; to the mappings of a directed light d, along which its light
 * leaves, stands for the place. */
inline TexturePoint area_lookup(LightRow l, TexturePoint point, vec3 d)
{
    point.p = sel3(light_mode(l, EMISSION_DIRECTED), d, point.p);
    return point;
}

/* Twin, where the light of no shape depends on its direction. */
#define area_lookup(l, point, d) (point)

/* Step shows: whether the side of a shape that a ray met emits; front: it met the front. */
inline mask light_shows(Scene scene, integer row, mask front)
{
    LightRow l = light_at(scene, max_i(row, (integer)(0)));
    return (front | light_mode(l, EMISSION_BOTH)) & !light_mode(l, EMISSION_UNSEEN);
}

/* Twin, where rays see the fronts of all lights on shapes, and nothing else. */
#define light_shows(scene, row, front) (front)
