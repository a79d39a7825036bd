/* What every integrator begins with at a vertex: the path that arrives, the surface that it meets, and
 * what has absorbed of it on the way. */
typedef struct {
    vec3 o, d;            /* the ray that arrives; d of unit length */
    real t;               /* and its length [m] */
    Wavelengths lambdas;
    Spectrum beta;        /* throughput, here */
    integer state, depth; /* see path/path_state.cl */
    Surface s;
    mask front;           /* which side was hit */
    integer row;          /* of the material */
#if USES_ABSORPTION
    integer medium;       /* that the ray has come through */
    integer inside;       /* what is behind the surface */
#endif
} Vertex;

inline Vertex vertex_load(Scene scene, Slab path, Slab hit, At at, mask active)
{
    Vertex v;
    v.o = load_path_o(path, at);
    v.d = load_path_d(path, at);
    v.t = load_hit_t(hit, at);
    v.lambdas = load_path_lambdas(path, at);
    v.beta = load_path_beta(path, at);
    v.state = load_path_state(path, at);
    v.depth = v.state & PATH_DEPTH;
    v.s = surface_load(scene, hit, at, active, v.o, v.d, &v.front);
    v.row = MATERIAL_ROW(sel_i(active, load_hit_material(hit, at), (integer)(0)));
#if USES_ABSORPTION
    v.inside = BSDF_INTERIOR(v.row);
    v.medium = medium_met(sel_i(active, load_path_medium(path, at), (integer)(0)), v.inside, v.front);
    v.beta = spectrum_mul(v.beta, medium_transmittance(scene, v.medium, v.t, v.lambdas));
#endif
    return v;
}

/* The side of the surface to which the material sends light, for interface/light.cl. */
inline vec3 vertex_side(Frame frame, vec3 wo)
{
    real sign = BSDF_TRANSMITS ? (real)(0.0f) : sel(wo.z < 0.0f, (real)(-1.0f), (real)(1.0f));
    return scale3(frame.n, sign);
}

/* `value` after t metres along w, which leads away from the vertex. */
inline Spectrum vertex_beyond(Scene scene, Vertex v, vec3 w, real t, Wavelengths lambdas, Spectrum value)
{
#if USES_ABSORPTION
    integer medium = medium_beyond(v.medium, v.inside, v.front, dot3(v.s.n, w) < 0.0f);
    value = spectrum_mul(value, medium_transmittance(scene, medium, t, lambdas));
#endif
    return value;
}

/* The path goes on from here, along d. */
inline void vertex_leave(Slab path, At at, mask next, Vertex v, vec3 d, Spectrum beta)
{
    store_path_o(path, at, next, surface_offset(v.s, d));
    store_path_d(path, at, next, d);
    store_path_beta(path, at, next, beta);
#if USES_ABSORPTION
    store_path_medium(path, at, next, medium_beyond(v.medium, v.inside, v.front, dot3(v.s.n, d) < 0.0f));
#endif
}
