/* Flights that end near lamps, see media/equiangular.cl. */
#include "media/equiangular.cl"

typedef struct {
    Equiangular ends;
    mask aims;     /* the flight is one of these */
    real left, by_angle; /* share of other flights; the distance of this one [m] */
} FlightNear;

/* Chooses whether a flight is one by u, of which the rest is as good as new. */
inline FlightNear flight_near(Scene scene, Sampler sampler, integer vertex, integer name, vec3 o, vec3 d, real end,
                              Medium m, mask scatters, real *u)
{
    real choice = AIM_COUNT > 1 ? sampler_pair(sampler, as_natural(DIMENSION_AIM + vertex)).x : (real)(0.0f);
    FlightNear n;
    n.ends = equiangular(scene, o, d, end, spectrum_mean(m.sigma_t), choice);
    n.ends.share = flight_near_share(name, n.ends.share);
    n.aims = scatters & (*u < n.ends.share);
    n.left = 1.0f - n.ends.share;
    n.by_angle = equiangular_distance(n.ends, *u / max_r(n.ends.share, (real)(1e-9f)));
    *u = max_r(*u - n.ends.share, (real)(0.0f)) / n.left;
    return n;
}
inline real flight_near_end(FlightNear n, real t) { return sel(n.aims, n.by_angle, t); }
inline Spectrum flight_near_pdf(FlightNear n, real t, mask collides, Spectrum pdf)
{
    real nearby = sel(collides, n.ends.share * equiangular_pdf(n.ends, t), (real)(0.0f));
    return spectrum_add(spectrum_scale(pdf, n.left), spectrum_of(nearby));
}

/* Twin, without lamps in media, and for paths from lamps, which have no reason to stay. */
typedef integer FlightNear;
#define flight_near(scene, sampler, vertex, name, o, d, end, m, scatters, u) ((integer)(0))
#define flight_near_end(n, t) (t)
#define flight_near_pdf(n, t, collides, pdf) (pdf)
