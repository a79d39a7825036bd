/* What integrators share at a vertex of a path: the ray that arrives, the surface that it meets, how the material
 * scatters there, and how the path goes on. The ray's throughput has been dimmed by what absorbs along it. */
#include "generated/cone.cl"

typedef struct {
    vec3 o, d;            /* the ray that arrives; d of unit length */
    real t;               /* and its length [m] */
    Wavelengths lambdas;
    Spectrum beta;        /* throughput, here */
    integer state, depth; /* see path/path_state.cl */
    integer met;          /* surfaces so far, with the null ones, which are no depth */
    Surface s;
    mask front;           /* the front was hit */
    integer row;          /* of the material */
    Cone cone;            /* around the ray, here */
#if NAMES_SURFACES
    integer object, primitive, material; /* index in the scene's shapes, number in the shape, number of the material */
#endif
#if USES_ABSORPTION
    integer medium;       /* that the ray has come through */
    integer inside;       /* what is behind the surface */
    integer outside;      /* and before it, where its shape says so */
#endif
#if USES_BODIES
    BodyBoundary bodies;  /* then `inside` and `outside` are what rays come into, to the back and to the front */
#endif
} Vertex;

/* |cosine| of a direction d to a surface of normal n, by which densities of its directions become those of points. In
 * a medium the extinction is in its place: it is the same for light that comes the other way, and counts as 1. */
#if BSDF_IS_PHASE
#define VERTEX_COSINE(n, d) ((real)(1.0f))
#else
#define VERTEX_COSINE(n, d) fabs(dot3(n, d))
#endif

/* The material at a vertex, and the random numbers of the vertex. */
typedef struct {
    Sampler sampler;
    natural dimension;     /* the first of the vertex */
    vec2 choice;           /* chooses a light, and a lobe; 0 where there is nothing to choose */
    Wavelengths lambdas;   /* by which light comes: others than the vertex's where it fluoresces */
    Bsdf bsdf;
    ShadingFrame shading;
    vec3 wo;               /* to where the ray comes from, in shading.frame */
} Scattering;

inline Vertex vertex_load(Scene scene, Slab path, Slab hit, uint at, mask active)
{
    Vertex v;
    v.o = load_path_o(path, at);
    v.d = load_path_d(path, at);
    v.t = load_hit_t(hit, at);
    v.lambdas = load_path_lambdas(path, at);
    v.beta = load_path_beta(path, at);
    v.state = load_path_state(path, at);
    v.depth = v.state & PATH_DEPTH;
    v.met = v.depth + load_path_nulls(path, at);
#if BSDF_IS_PHASE
    v.s = surface_of_point(madd3(v.d, v.t, v.o));
    v.front = mask_of(1);
#else
    v.s = surface_load(scene, hit, at, active, v.o, v.d, &v.front);
#endif
    v.cone = cone_after(load_path_cone(path, at), v.t);
    v.s.footprint = cone_footprint(v.cone, v.d, v.s.n, v.s.dpdu, v.s.dpdv);
    v.row = MATERIAL_ROW(sel_i(active, load_hit_material(hit, at), (integer)(0)));
#if NAMES_SURFACES && BSDF_IS_PHASE
    v.object = v.primitive = v.material = -1;
#elif NAMES_SURFACES
    integer row = sel_i(active, load_hit_shape(hit, at), (integer)(0));
    ShapeRow shape = shape_row_row(scene.shapes, row * SHAPE_ROW_WORDS);
#if MATERIAL_NUMBERS
    v.material = to_integer(gather(scene.distributions, MATERIAL_NUMBERS + row));
#endif
    v.object = shape.number;
#if USES_INSTANCES
    integer instance = sel_i(active, load_hit_instance(hit, at), (integer)(0));
    integer placed = sel_i(instance > 0, instance - 1, (integer)(0)) * INSTANCE_ROW_WORDS;
    v.object = sel_i(instance > 0, instance_row_row(scene.instances, placed).number, v.object);
#endif
    mask many = (shape.kind == 0) | ((shape.flags & SHAPE_MANY) != 0);
    v.primitive = sel_i(active & many, load_hit_prim(hit, at) - shape.prim, (integer)(0));
#endif
#if USES_BODIES
    integer bodies = sel_i(active, load_path_bodies(path, at), (integer)(0)), shape_row = 0;
#if !BSDF_IS_PHASE
    shape_row = sel_i(active, load_hit_shape(hit, at), (integer)(0));
#endif
    v.bodies = body_boundary(scene, shape_row, bodies, v.front);
#if BSDF_IS_PHASE
    v.bodies.body = 0;
    v.bodies.others = bodies;
#endif
    v.inside = body_medium(scene, bodies_top(bodies_beyond(v.bodies, mask_of(1))));
    v.outside = body_medium(scene, bodies_top(v.bodies.others));
    v.medium = sel_i(active, load_path_medium(path, at), (integer)(0));
#elif USES_ABSORPTION
    v.inside = BSDF_INTERIOR(v.row);
    v.outside = 0;
#if USES_MEDIA && !BSDF_IS_PHASE
    ShapeMedia own = shape_media(scene, sel_i(active, load_hit_shape(hit, at), (integer)(0)));
    v.inside = sel_i(own.inside != 0, own.inside, v.inside);
    v.outside = own.outside;
#endif
    v.medium = medium_met(sel_i(active, load_path_medium(path, at), (integer)(0)), v.inside, v.front);
#endif
#if USES_ABSORPTION
    real through = v.t + sel(active, load_path_lead(path, at), (real)(0.0f));
    v.beta = spectrum_mul(v.beta, medium_transmittance(scene, MEDIUM_LEFT(v.medium), through, v.lambdas));
#endif
    return v;
}

#if BSDF_COAT_APART
/* The material, whose coat's normal is told by the surface's u, v and normal, in the frame where it is shaded. */
inline Bsdf coat_normal_turned(Bsdf m, Surface s, Frame shaded)
{
    Frame own = surface_frame(s);
    real scale = m.clearcoat_normal_scale, x = (2.0f * m.clearcoat_normal_x - 1.0f) * scale;
    real y = (2.0f * m.clearcoat_normal_y - 1.0f) * scale;
    vec3 n = v3(x, sel(dot3(own.t, s.dpdv) < 0.0f, -y, y), 2.0f * m.clearcoat_normal_z - 1.0f);
    n = to_local(shaded, to_world(own, normalize3(n)));
    m.clearcoat_normal_x = 0.5f * n.x + 0.5f;
    m.clearcoat_normal_y = 0.5f * n.y + 0.5f;
    m.clearcoat_normal_z = 0.5f * n.z + 0.5f;
    m.clearcoat_normal_scale = 1.0f;
    return m;
}
#endif

/* Loads the material. Where it fluoresces, the `active` paths take the wavelengths by which light comes. */
inline Scattering vertex_scattering(Scene scene, Slab path, uint at, mask active, Vertex v, Sampler sampler)
{
    Scattering scatter;
    scatter.sampler = sampler;
    scatter.dimension = as_natural(DIMENSION_VERTEX + v.met * DIMENSIONS_A_VERTEX);
    scatter.choice.x = 0.0f;
    scatter.choice.y = 0.0f;
#if USES_CHOICE
    scatter.choice = sampler_pair(sampler, scatter.dimension + DIMENSION_CHOICE);
#endif
    scatter.lambdas = v.lambdas;
    TexturePoint point = surface_texture_point(v.s);
#if STOCHASTIC_FILTERING
    point.u = sampler_pair(sampler, as_natural(DIMENSION_TEXEL + v.met));
#endif
    scatter.bsdf = bsdf_load(scene, v.row, point, v.lambdas);
#if BSDF_BETWEEN_BODIES
    integer index = body_word(scene, v.bodies.next, 1);
    mask known = active & (v.bodies.next != 0) & (index != 0);
    if (any(known)) {
        Spectrum outside = body_index(scene, sel_i(known, index, (integer)(0)), texture_point_nowhere(), v.lambdas);
        scatter.bsdf.ext_ior = spectrum_sel(known, outside, scatter.bsdf.ext_ior);
    }
#endif
#if BSDF_FLUORESCES
    scatter.lambdas = bsdf_shift(scene, v.row, scatter.bsdf, v.lambdas, scatter.choice.y, v.depth);
    store_path_lambdas(path, at, active, scatter.lambdas);
#endif
    scatter.shading = shading_frame_load(scene, v.row, v.s, v.d, scatter.lambdas);
#if BSDF_COAT_APART
    scatter.bsdf = coat_normal_turned(scatter.bsdf, v.s, scatter.shading.frame);
#endif
    scatter.wo = to_local(scatter.shading.frame, neg3(v.d));
    return scatter;
}

/* The normal of the hemisphere to which the material sends light, 0 if to the whole sphere: for interface/light.cl. */
inline vec3 vertex_hemisphere(Frame frame, vec3 wo)
{
    real sign = BSDF_TRANSMITS ? (real)(0.0f) : sel(wo.z < 0.0f, (real)(-1.0f), (real)(1.0f));
    return scale3(frame.n, sign);
}

#if USES_ABSORPTION
/* The medium along w, which leads away from the vertex. */
inline integer vertex_medium(Vertex v, vec3 w)
{
#if USES_BODIES
    return sel_i(dot3(v.s.n, w) < 0.0f, v.inside, v.outside);
#else
    return medium_beyond(v.medium, v.inside, v.outside, v.front, dot3(v.s.n, w) < 0.0f);
#endif
}
#endif

/* `value` after t metres along w, which leads away from the vertex. */
inline Spectrum vertex_beyond(Scene scene, Vertex v, vec3 w, real t, Wavelengths lambdas, Spectrum value)
{
#if USES_ABSORPTION && !SHADOW_MEDIA /* else the ray itself is dimmed, see tracing/transmittance_media.cl */
    integer medium = vertex_medium(v, w);
    value = spectrum_mul(value, medium_transmittance(scene, medium, t, lambdas));
#endif
    return value;
}

/* Whether what leaves by such a lobe has met a null surface. */
inline mask vertex_is_null(integer lobe)
{
#if BSDF_IS_NULL
    return mask_of(1);
#elif BSDF_IS_PANE
    return (lobe & LOBE_NULL) != 0;
#else
    return mask_of(0);
#endif
}

/* Whether paths may be longer than to this vertex; null: those that it does not count for. */
inline mask vertex_continues(Scene scene, Vertex v, mask null)
{
#if BSDF_IS_NULL
    return v.met - v.depth < MOST_NULL_SURFACES;
#else
    mask more = v.depth + 1 < scene.settings->max_depth;
#if BSDF_IS_PANE
    more = sel_i(null, v.met - v.depth < MOST_NULL_SURFACES, more);
#endif
    return more;
#endif
}

/* The `next` paths go on from here, along d; null: for which nothing has happened, as the surface is none. */
inline void vertex_leave(Slab path, uint at, mask next, mask null, Vertex v, vec3 d, Spectrum beta)
{
#if BSDF_IS_NULL || BSDF_IS_PANE /* the camera's ray has its end, and lights are weighed by what was before */
    real pdf = load_path_pdf(path, at), onward = v.t + surface_lead(v.s, d);
    store_path_pdf(path, at, next & null & (v.depth == 0), pdf + onward);
    store_path_null_distance(path, at, next & null, load_path_null_distance(path, at) + onward);
#endif
    store_path_o(path, at, next, surface_offset(v.s, d));
    store_path_d(path, at, next, d);
    store_path_beta(path, at, next, beta);
#if USES_ABSORPTION
    store_path_medium(path, at, next, vertex_medium(v, d));
    store_path_lead(path, at, next, surface_lead(v.s, d));
#endif
#if USES_BODIES
    store_path_bodies(path, at, next, bodies_beyond(v.bodies, dot3(v.s.n, d) < 0.0f));
#endif
}

/* The `active` paths are a vertex longer, if it is not a null surface; those that do not go on are no longer alive. */
inline void vertex_end(Slab path, uint at, mask active, mask next, mask null, integer state)
{
    state = sel_i(next, state, state - (state & PATH_ALIVE));
#if BSDF_IS_NULL || BSDF_IS_PANE
    store_path_nulls(path, at, active & null, load_path_nulls(path, at) + 1);
#endif
#if BSDF_IS_NULL
    store_path_state(path, at, active, state);
#else
    store_path_state(path, at, active, sel_i(null, state, state + 1));
#endif
}
