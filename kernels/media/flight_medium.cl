/* The medium of a ray among bodies, which its path stores. A body of higher priority hides a surface inside of it:
 * the hit becomes a null surface. */
inline integer flight_medium(Scene scene, Slab path, Slab hit, uint at, mask alive, mask met)
{
    integer shape = sel_i(met, load_hit_shape(hit, at), (integer)(0));
    mask front = dot3(load_hit_n(hit, at), load_path_d(path, at)) < 0.0f;
    BodyBoundary boundary = body_boundary(scene, shape, load_path_bodies(path, at), front);
    store_hit_material(hit, at, met & boundary.hidden, body_word(scene, (integer)(0), 0));
    return load_path_medium(path, at);
}

/* Twin, where bodies do not overlap: a ray without a medium takes that of the side of the surface that it hits. */
inline integer flight_medium(Scene scene, Slab path, Slab hit, uint at, mask alive, mask met)
{
    ShapeMedia own = shape_media(scene, sel_i(met, load_hit_shape(hit, at), (integer)(0)));
    mask front = dot3(load_hit_n(hit, at), load_path_d(path, at)) < 0.0f;
    integer medium = load_path_medium(path, at);
    integer name = sel_i(met & (medium == 0), sel_i(front, own.outside, own.inside), medium);
    store_path_medium(path, at, alive, name);
    return name;
}
