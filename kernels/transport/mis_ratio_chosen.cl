/* The chance of the light for the mis_ratio of a light path at its first vertex. The light tree chooses by the gloss of
 * the surface (receiver), so the chance depends on the next direction of the light path. */
inline MisRatio mis_ratio_chosen(Scene scene, Slab path, uint at, Vertex v, MisRatio r, Receiver receiver)
{
    if (any(r.first)) {
        integer row = sel_i(r.first, load_path_light(path, at), (integer)(0));
        real chance = common_light_tree_pmf(scene, row, v.s.p, receiver);
        r.nee_pdf *= sel(r.first, chance, (real)(1.0f));
    }
    return r;
}

/* Twin, where the chance of a light does not depend on the direction of its light. */
inline MisRatio mis_ratio_chosen(Scene scene, Slab path, uint at, Vertex v, MisRatio r, Receiver receiver) { return r; }
