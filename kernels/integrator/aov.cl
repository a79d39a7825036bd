/* Arbitrary output values of the first surface, in three channels; CHANNEL says which. Depth along the ray and position
 * in metres. */
#define CHANNEL_DEPTH 0
#define CHANNEL_POSITION 1
#define CHANNEL_GEOMETRIC_NORMAL 2
#define CHANNEL_SHADING_NORMAL 3
#define CHANNEL_UV 4
#define CHANNEL_ALBEDO 5
#define CHANNEL_SHAPE_ID 6
#define CHANNEL_PRIMITIVE_ID 7

void integrator_vertex(Scene scene, Slab path, Slab hit, Slab shadow, At at, mask active)
{
    mask front;
    Surface s = surface_load(scene, hit, at, active, load_path_o(path, at), load_path_d(path, at), &front);
    integer row = sel_i(active, load_hit_shape(hit, at), (integer)(0)) * SHAPE_ROW_WORDS;
    ShapeRow shape = shape_row_row(scene.shapes, row);
    vec3 v = v3(0.0f, 0.0f, 0.0f);
#if CHANNEL == CHANNEL_DEPTH
    v.x = load_hit_t(hit, at);
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
    store_path_state(path, at, active, load_path_state(path, at) - PATH_ALIVE + 1);
}
