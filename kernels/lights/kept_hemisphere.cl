/* The hemisphere to which the surface sends light where a ray was chosen: lights are chosen by it. */
inline Receiver path_receiver(Slab path, uint at) { Receiver r = {load_path_sampled_hemisphere(path, at)}; return r; }

inline void path_receiver_keep(Slab path, uint at, mask m, Receiver r)
{
    store_path_sampled_hemisphere(path, at, m, r.hemisphere);
}

/* Twin, where no light is chosen by it. */
inline Receiver path_receiver(Slab path, uint at) { Receiver r = {v3(0.0f, 0.0f, 0.0f)}; return r; }
inline void path_receiver_keep(Slab path, uint at, mask m, Receiver r) {}
