/* Distance sampling in media on grids, which replaces that in homogeneous media. */
#include "generated/grid_origin.cl"

/* No flight in a grid aims at a lamp (media/equiangular.cl). */
inline real flight_near_share(integer name, real share) { return sel((name & MEDIUM_GRID) != 0, (real)(0.0f), share); }

inline void flight_grids(Scene scene, Slab path, uint at, mask flies, integer name, FlightRay r, Spectrum ratio,
                         Wavelengths lambdas, Spectrum *light, Spectrum *weight, mask *collides, real *t, Medium *m)
{
    mask gridded = flies & ((name & MEDIUM_GRID) != 0);
    if (any(gridded)) {
        natural key = grid_key(scene, load_path_pixel_key(path, at), load_path_sample(path, at), r.vertex);
        GridOrigin origin = {(real)(0.0f)};
        grid_origin_load(path, at, r, &origin);
        GridFlight own = grid_flight(scene, name, *m, r.o, r.d, r.end, ratio, r.u, key, gridded, lambdas, origin);
        *light = spectrum_sel(gridded, own.light, *light);
        *weight = spectrum_sel(gridded, own.weight, *weight);
        *collides = sel_i(gridded, own.collides, *collides);
        *t = sel(gridded, own.t, *t);
        store_path_ratio(path, at, gridded, own.ratio);
        if (any(own.endless)) store_path_radiance(path, at, gridded & own.endless, spectrum_of(INFINITY));
        m->phase = sel_i(gridded, own.phase, m->phase);
    }
}

/* Twin, where no medium is on a grid. */
inline real flight_near_share(integer name, real share) { return share; }
inline void flight_grids(Scene scene, Slab path, uint at, mask flies, integer name, FlightRay r, Spectrum ratio,
                         Wavelengths lambdas, Spectrum *light, Spectrum *weight, mask *collides, real *t, Medium *m) {}
