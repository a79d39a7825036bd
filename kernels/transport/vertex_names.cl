/* What layers call a surface: its index in the scene's shapes, its number in the shape, and that of its material. */
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
    if (rows) { /* as the caller counts faces, and strands */
        integer place = as_integer(gather(scene.distributions, rows + row));
        mask listed = active & (place > 0);
        integer told = as_integer(gather(scene.distributions, sel_i(listed, place + own, (integer)(0))));
        v->primitive = sel_i(listed, told, v->primitive);
    }
}

/* Twin, where no layer names what is seen. */
inline void vertex_names(Scene scene, Slab hit, uint at, mask active, Vertex *v) {}
