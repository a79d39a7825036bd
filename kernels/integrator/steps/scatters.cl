/* A path keeps the density of its next direction, to weigh the light that it meets there. */
inline void path_scatters(Scene scene, Slab path, uint at, mask next, mask null, Vertex *v, Scattering scatter,
                          MisRatio mis_ratio, BsdfSample bs, vec3 onward)
{
    mask scatters = next & !null, delta = (bs.lobe & LOBE_DELTA) != 0;
    path_scattered(path, at, scatters);
    delta = delta | vertex_sealed(*v); /* light that is met there has its whole weight */
    bs.pdf = keep_mis_ratio_to_light(path, at, scatters, mis_ratio, v, onward, delta, bs);
    store_path_pdf(path, at, scatters, sel(delta, (real)(-1.0f), bs.pdf));
    if (!BSDF_DELTA) path_receiver_keep(path, at, next, vertex_receiver(scene, *v, scatter, neg3(v->d)));
}

/* Twin, at null surfaces, where a path has no new direction. */
inline void path_scatters(Scene scene, Slab path, uint at, mask next, mask null, Vertex *v, Scattering scatter,
                          MisRatio mis_ratio, BsdfSample bs, vec3 onward) {}
