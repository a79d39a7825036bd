/* What the surface does with light where a ray was chosen: lights are chosen by it. */
inline Receiver path_receiver(Slab path, uint at)
{
    natural wo = load_path_sampled_wo(path, at), gloss = load_path_sampled_gloss(path, at);
    return receiver_of(load_path_sampled_hemisphere(path, at), wo, gloss);
}

inline void path_receiver_keep(Slab path, uint at, mask m, Receiver r)
{
    store_path_sampled_hemisphere(path, at, m, r.hemisphere);
    store_path_sampled_wo(path, at, m, r.toward);
    store_path_sampled_gloss(path, at, m, r.gloss);
}
