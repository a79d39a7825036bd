/* The camera's ray goes on behind a light that is to be hidden. */
inline void hide_light(Slab path, uint at, mask hidden, Vertex v)
{
    store_path_o(path, at, hidden, surface_offset(v.s, v.d));
    store_path_pdf(path, at, hidden, load_path_pdf(path, at) + v.t);
    store_path_null_distance(path, at, hidden, load_path_null_distance(path, at) + v.t);
    store_path_cone(path, at, hidden, cone_word(v.cone));
    store_path_rival(path, at, hidden, (real)(0.0f)); /* the light is in the way of what light paths bring there */
}
