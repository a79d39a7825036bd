/* The rival of a light path at its first vertex, where lights are chosen by the gloss of a surface: how often a path
 * from the camera chooses the light is known when it is known from where that path comes (receiver). */
inline Rival rival_chosen(Scene scene, Slab path, uint at, Vertex v, Rival r, Receiver receiver)
{
    if (any(r.first)) {
        integer row = sel_i(r.first, load_path_light(path, at), (integer)(0));
        real chance = common_light_tree_pmf(scene, row, v.s.p, receiver);
        r.found *= sel(r.first, chance, (real)(1.0f));
    }
    return r;
}

/* Twin, where the chance of a light does not hang on where its light goes. */
#define rival_chosen(scene, path, at, v, r, receiver) (r)
