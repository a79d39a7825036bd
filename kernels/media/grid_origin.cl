/* The origin and density of a flight's direction, for the MIS weights of emission from grids. */
inline void grid_origin_load(Slab path, uint at, FlightRay r, GridOrigin *origin)
{
    origin->pdf = load_path_pdf(path, at);
    origin->before = load_path_null_distance(path, at) - r.ray_offset;
    origin->from = madd3(r.d, -origin->before, r.o);
    origin->receiver = path_receiver(path, at);
}

/* Twin, where no grid emits. */
inline void grid_origin_load(Slab path, uint at, FlightRay r, GridOrigin *origin) {}
