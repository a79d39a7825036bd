/* A vertex of a path: the incident ray (throughput includes absorption), the surface, scattering, continuation. */
#include "generated/cone.cl"
#include "generated/vertex_media.cl"
#include "generated/optical_length.cl"

typedef struct {
    vec3 o, d;            /* incident ray; d of unit length */
    real t;               /* its length [m] */
    Wavelengths lambdas;
    Spectrum beta;        /* throughput, here */
    integer state, depth; /* see transport/path_state.cl */
    integer surfaces;     /* number of surfaces so far; null surfaces count here, and not in depth */
    Surface s;
    mask front;           /* the front was hit */
    integer row;          /* of the material */
    Cone cone;            /* around the ray, here */
    integer object, primitive, material; /* identifiers, see vertex_names */
    VertexMedia media;    /* media around the vertex */
} Vertex;

#include "generated/vertex_steps.cl"

/* |cosine| of a direction d to a surface of normal n, which converts densities of directions to densities of points. In
 * a medium extinction takes its place: it is equal for both directions of light, and counts as 1. */
#if BSDF_IS_PHASE
#define VERTEX_COSINE(n, d) ((real)(1.0f))
#else
#define VERTEX_COSINE(n, d) fabs(dot3(n, d))
#endif

#define VERTEX_COUNTS (!BSDF_IS_NULL && !BSDF_IS_PANE) /* it adds to the path's depth, whatever the lobe */

typedef struct {
    Sampler sampler;
    natural dimension;     /* the first of the vertex */
    vec2 choice;           /* selects a light, and a lobe; 0 without a choice */
    Wavelengths lambdas;   /* of incident light: differ from the vertex's at fluorescence */
    Bsdf bsdf;
    ShadingFrame shading;
    vec3 wo;               /* to the previous vertex, in shading.frame */
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
    v.surfaces = v.depth + load_path_nulls(path, at);
#if BSDF_IS_PHASE
    v.s = surface_of_point(madd3(v.d, v.t, v.o));
    v.front = mask_of(1);
#else
    v.s = common_surface_load(scene, hit, at, active, v.o, v.d, &v.front);
#endif
    v.cone = cone_after(load_path_cone(path, at), v.t);
    v.s.footprint = cone_footprint(v.cone, v.d, v.s.n, v.s.dpdu, v.s.dpdv);
    v.row = MATERIAL_ROW(sel_i(active, load_hit_material(hit, at), (integer)(0)));
    vertex_names(scene, hit, at, active, &v);
    v.media = vertex_media(scene, path, hit, at, active, v.row, v.front);
    v.beta = vertex_arriving(scene, path, at, active, v);
    return v;
}

/* Loads the material. Where it fluoresces, the `active` paths take the wavelengths of the incident light. */
inline Scattering vertex_scattering(Scene scene, Slab path, uint at, mask active, Vertex v, Sampler sampler)
{
    Scattering scatter;
    scatter.sampler = sampler;
    scatter.dimension = as_natural(DIMENSION_VERTEX + v.surfaces * DIMENSIONS_A_VERTEX);
    vec2 none = {0.0f, 0.0f};
    scatter.choice = USES_CHOICE ? sampler_pair(sampler, scatter.dimension + DIMENSION_CHOICE) : none;
    scatter.lambdas = v.lambdas;
    TexturePoint point = surface_texture_point(v.s);
#if STOCHASTIC_FILTERING
    point.u = sampler_pair(sampler, as_natural(DIMENSION_TEXEL + v.surfaces));
#endif
    scatter.bsdf = bsdf_load(scene, v.row, point, v.lambdas);
    bsdf_between_bodies(scene, active, v, &scatter.bsdf);
#if BSDF_FLUORESCES
    scatter.lambdas = bsdf_shift(scene, v.row, scatter.bsdf, v.lambdas, scatter.choice.y, v.depth);
    store_path_lambdas(path, at, active, scatter.lambdas);
#endif
    scatter.shading = shading_frame_load(scene, v.row, v.s, v.d, scatter.lambdas);
    scatter.bsdf = coat_normal_turned(scene, v.row, scatter.bsdf, v.s, scatter.shading.frame);
    scatter.bsdf = anisotropy_turned(scene, v.row, scatter.bsdf, v.s, scatter.shading.frame);
    scatter.wo = to_frame(scatter.shading.frame, neg3(v.d));
    return scatter;
}

#if USES_LIGHTS && BSDF_IS_PHASE && SEALED_MEDIA
#define BSDF_IS_SEALED 1
#define vertex_sealed(v) (((v).media.medium & MEDIUM_SEALED) != 0)
#else
#define BSDF_IS_SEALED 0
#define vertex_sealed(v) mask_of(0)
#endif

/* The hemisphere, or 0 for the sphere, of the material's scattered light, and its gloss along `away`. */
inline Receiver vertex_receiver(Scene scene, Vertex v, Scattering scatter, vec3 away)
{
    real sign = BSDF_TRANSMITS ? (real)(0.0f) : sel(scatter.wo.z < 0.0f, (real)(-1.0f), (real)(1.0f));
    return receiver_at(scene, v.row, scale3(scatter.shading.frame.n, sign), away);
}

/* Whether a path crosses a null surface here: a hole, a null boundary, or a pane by its lobe. */
inline mask vertex_is_null(integer lobe)
{
    return BSDF_IS_NULL ? mask_of(1) : BSDF_IS_PANE ? (lobe & LOBE_NULL) != 0 : mask_of(0);
}

/* Whether max_depth, or the most null surfaces, lets paths go on; null: paths that cross a null surface. */
inline mask vertex_continues(Scene scene, Vertex v, mask null)
{
    mask more = v.depth + 1 < scene.settings->max_depth, beyond = v.surfaces - v.depth < MOST_NULL_SURFACES;
    return BSDF_IS_NULL ? beyond : BSDF_IS_PANE ? sel_i(null, beyond, more) : more;
}

/* Continues the `next` paths along d; null: paths that cross a null surface. */
inline void vertex_leave(Slab path, uint at, mask next, mask null, Vertex v, vec3 d, Spectrum beta)
{
    if (BSDF_IS_NULL || BSDF_IS_PANE) {
        /* A null surface splits a ray in two. MIS weights need the whole ray: null_distance is the length before the
         * present origin, and for a camera ray Path.pdf is the length to the end of its range (stage/intersect.cl). */
        real pdf = load_path_pdf(path, at), onward = v.t + surface_ray_offset(v.s, d);
        store_path_pdf(path, at, next & null & (v.depth == 0), pdf + onward);
        store_path_null_distance(path, at, next & null, load_path_null_distance(path, at) + onward);
    }
    store_path_o(path, at, next, surface_offset(v.s, d));
    store_path_d(path, at, next, d);
    store_path_beta(path, at, next, beta);
    store_path_medium(path, at, next, vertex_medium(v, d));
    store_path_around(path, at, next, vertex_around(v, d));
    store_path_ray_offset(path, at, next, surface_ray_offset(v.s, d));
    store_path_bodies(path, at, next, vertex_through(v, d));
    length_add(path, at, next, v.t);
}

/* Adds the vertex to the depth, unless it is a null surface; ends the paths outside of `next`. */
inline void vertex_end(Slab path, uint at, mask active, mask next, mask null, integer state)
{
    state = sel_i(next, state, state - (state & PATH_ALIVE));
    if (BSDF_IS_NULL || BSDF_IS_PANE) store_path_nulls(path, at, active & null, load_path_nulls(path, at) + 1);
    store_path_state(path, at, active, BSDF_IS_NULL ? state : sel_i(null, state, state + 1));
}

inline void hide_light(Slab path, uint at, mask hidden, Vertex v) /* a camera ray continues behind the light */
{
    store_path_o(path, at, hidden, surface_offset(v.s, v.d));
    store_path_pdf(path, at, hidden, load_path_pdf(path, at) + v.t);
    store_path_null_distance(path, at, hidden, load_path_null_distance(path, at) + v.t);
    store_path_cone(path, at, hidden, cone_word(v.cone));
    length_add(path, at, hidden, v.t);
    store_path_mis_ratio(path, at, hidden, (real)(0.0f)); /* light paths cannot pass the light */
}

/* Step names: identifiers of a surface for layers: its index in the scene's shapes, its primitive, and its material. */
inline void vertex_names(Scene scene, Slab hit, uint at, mask active, Vertex *v)
{
    v->object = v->primitive = v->material = -1;
    if (BSDF_IS_PHASE) return;
    integer row = sel_i(active, load_hit_shape(hit, at), (integer)(0));
    ShapeRow shape = shape_row_row(scene.shapes, row * SHAPE_ROW_WORDS);
    int numbers = scene.settings->material_numbers;
    if (numbers) v->material = to_integer(gather(scene.distributions, numbers + row));
    v->object = shape.number;
#if USES_INSTANCES
    integer instance = sel_i(active, load_hit_instance(hit, at), (integer)(0));
    integer placed = sel_i(instance > 0, instance - 1, (integer)(0)) * INSTANCE_ROW_WORDS;
    v->object = sel_i(instance > 0, instance_row_row(scene.instances, placed).number, v->object);
#endif
    mask many = (shape.kind == 0) | ((shape.flags & SHAPE_MANY) != 0);
    integer own = load_hit_prim(hit, at) - shape.prim;
    v->primitive = sel_i(active & many, own, (integer)(0));
    int rows = scene.settings->primitive_rows;
    if (rows) { /* by the caller's numbers of faces, or strands */
        integer place = as_integer(gather(scene.distributions, rows + row));
        mask listed = active & (place > 0);
        integer told = as_integer(gather(scene.distributions, sel_i(listed, place + own, (integer)(0))));
        v->primitive = sel_i(listed, told, v->primitive);
    }
}

/* Twin, where no layer needs identifiers. */
inline void vertex_names(Scene scene, Slab hit, uint at, mask active, Vertex *v) {}
