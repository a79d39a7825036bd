/* The medium of a ray that flies, which its path keeps. */
inline integer flight_medium(Scene scene, Slab path, Slab hit, uint at, mask alive, mask met)
{
    ShapeMedia own = shape_media(scene, sel_i(met, load_hit_shape(hit, at), (integer)(0)));
    mask front = dot3(load_hit_n(hit, at), load_path_d(path, at)) < 0.0f;
    integer medium = load_path_medium(path, at);
    /* One that knows of none is in that of the side of the surface that it meets. */
    integer name = sel_i(met & (medium == 0), sel_i(front, own.outside, own.inside), medium);
    store_path_medium(path, at, alive, name);
    return name;
}
