/* The light of a path that is weighed, for its first vertex, see transport/mis_ratio.cl. */
inline void light_kept(Slab path, uint at, mask go, LightRay r)
{
    store_path_light(path, at, go, r.row);
    store_path_sampled_hemisphere(path, at, go, r.n);
}

/* Twin, where light paths are not weighed. */
inline void light_kept(Slab path, uint at, mask go, LightRay r) {}
