/* The medium of a ray that flies among bodies; of a surface in a body of higher priority nothing is seen. */
inline integer flight_medium(Scene scene, Slab path, Slab hit, uint at, mask alive, mask met)
{
    integer shape = sel_i(met, load_hit_shape(hit, at), (integer)(0));
    mask front = dot3(load_hit_n(hit, at), load_path_d(path, at)) < 0.0f;
    BodyBoundary boundary = body_boundary(scene, shape, load_path_bodies(path, at), front);
    store_hit_material(hit, at, met & boundary.hidden, body_word(scene, (integer)(0), 0));
    return load_path_medium(path, at);
}
