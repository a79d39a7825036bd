/* Stores the density of the next direction: the MIS weight of a light that the next ray meets needs it. */
inline void path_scatters(Scene scene, Slab path, uint at, mask next, mask null, Vertex *v, Scattering scatter,
                          MisRatio mis_ratio, BsdfSample bs, vec3 onward)
{
    mask scatters = next & !null, delta = (bs.lobe & LOBE_DELTA) != 0;
    path_scattered(path, at, scatters);
    delta = delta | vertex_sealed(*v); /* next-event estimation cannot find a light from there: weight 1 */
    bs.pdf = keep_mis_ratio_to_light(path, at, scatters, mis_ratio, v, onward, delta, bs);
    store_path_pdf(path, at, scatters, sel(delta, (real)(-1.0f), bs.pdf));
    if (!BSDF_DELTA) path_receiver_keep(path, at, next, vertex_receiver(scene, *v, scatter, neg3(v->d)));
}

/* Twin, at null surfaces, where a path has no new direction. */
inline void path_scatters(Scene scene, Slab path, uint at, mask next, mask null, Vertex *v, Scattering scatter,
                          MisRatio mis_ratio, BsdfSample bs, vec3 onward) {}
