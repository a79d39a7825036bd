/* Arbitrary output values of the first surface that is not null, in three channels; CHANNEL says which. Depth along
 * the ray and position in metres. */
#define CHANNEL_DEPTH 0
#define CHANNEL_POSITION 1
#define CHANNEL_GEOMETRIC_NORMAL 2
#define CHANNEL_SHADING_NORMAL 3
#define CHANNEL_UV 4
#define CHANNEL_ALBEDO 5
#define CHANNEL_SHAPE_ID 6
#define CHANNEL_PRIMITIVE_ID 7

void integrator_vertex(Scene scene, Slab path, Slab hit, Slab shadow, uint at, mask active)
{
    Vertex vertex = vertex_load(scene, path, hit, at, active);
    Surface s = vertex.s;
#if BSDF_IS_NULL
    mask next = active & vertex_continues(scene, vertex);
    vertex_leave(path, at, next, vertex, vertex.d, vertex.beta);
    vertex_end(path, at, active, next, vertex.state);
#else
    integer row = sel_i(active, load_hit_shape(hit, at), (integer)(0)) * SHAPE_ROW_WORDS;
    ShapeRow shape = shape_row_row(scene.shapes, row);
    vec3 v = v3(0.0f, 0.0f, 0.0f);
#if CHANNEL == CHANNEL_DEPTH
    v.x = vertex.t + path_null_distance(path, at);
#elif CHANNEL == CHANNEL_POSITION
    v = s.p;
#elif CHANNEL == CHANNEL_GEOMETRIC_NORMAL
    v = s.n;
#elif CHANNEL == CHANNEL_SHADING_NORMAL
    v = s.ns;
#elif CHANNEL == CHANNEL_UV
    v = v3(s.uv.x, s.uv.y, (real)(0.0f));
#elif CHANNEL == CHANNEL_ALBEDO
    integer material = MATERIAL_ROW(sel_i(active, load_hit_material(hit, at), (integer)(0)));
    Spectrum albedo = bsdf_albedo(bsdf_load(scene, material, surface_texture_point(s), load_path_lambdas(path, at)));
    v = v3(albedo.x, albedo.y, albedo.z);
#elif CHANNEL == CHANNEL_SHAPE_ID
    integer number = shape.number;
#if USES_INSTANCES
    integer instance = sel_i(active, load_hit_instance(hit, at), (integer)(0));
    integer placed = sel_i(instance > 0, instance - 1, (integer)(0)) * INSTANCE_ROW_WORDS;
    number = sel_i(instance > 0, instance_row_row(scene.instances, placed).number, number);
#endif
    v.x = to_real(number);
#elif CHANNEL == CHANNEL_PRIMITIVE_ID
    v.x = sel((shape.kind == 0) | ((shape.flags & SHAPE_MANY) != 0), to_real(load_hit_prim(hit, at) - shape.prim),
              (real)(0.0f));
#endif
    Spectrum value = {v.x, v.y, v.z};
    store_path_radiance(path, at, active, value);
    vertex_end(path, at, active, mask_of(0), vertex.state);
#endif
}
