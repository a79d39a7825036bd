/* A light path that has had MOST_NULL_COLLISIONS on one way counts as rejected, as a path from the camera does: its
 * flight has left an infinite radiance (media/flight_grids.cl). */
inline void light_path_endless(Slab path, uint at, PathEnd end, global uint *counters)
{
    mask endless = end.ended & end.begun & (spectrum_max(load_path_radiance(path, at)) > 1e30f);
    count(counters, COUNTER_REJECTED, endless, (integer)(1));
}

/* Of light paths that begin. */
#define light_path_begins(path, at, go) store_path_radiance(path, at, go, spectrum_of(0.0f))

/* Twin, where there are no grids. */
#define light_path_endless(path, at, end, counters)
#define light_path_begins(path, at, go)
