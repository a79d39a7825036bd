/* Flights that end where a dye gives out light, see media/dye_flight.cl. */
#include "media/dye_flight.cl"

typedef struct {
    DyeFlight ends;
    mask glows; /* the flight is one of these */
    real by_dye; /* and its distance [m] */
} FlightDye;

/* Chooses whether a flight is one by u, of which the rest is as good as new. */
inline FlightDye flight_dye(integer name, Medium m, real end, mask scatters, real *u)
{
    FlightDye f;
    f.ends = dye_flight(name, m, end);
    f.glows = scatters & (*u < f.ends.share);
    f.by_dye = dye_distance(f.ends, *u / max_r(f.ends.share, (real)(1e-9f)));
    *u = max_r(*u - f.ends.share, (real)(0.0f)) / (1.0f - f.ends.share);
    return f;
}
inline real flight_dye_end(FlightDye f, real t) { return sel(f.glows, f.by_dye, t); }
inline Spectrum flight_dye_pdf(FlightDye f, real t, mask collides, Spectrum pdf)
{
    real dyes = sel(collides, f.ends.share * dye_pdf(f.ends, t), (real)(0.0f));
    return spectrum_add(spectrum_scale(pdf, 1.0f - f.ends.share), spectrum_of(dyes));
}

/* Twin, where no medium has a dye. */
typedef integer FlightDye;
#define flight_dye(name, m, end, scatters, u) ((integer)(0))
#define flight_dye_end(f, t) (t)
#define flight_dye_pdf(f, t, collides, pdf) (pdf)
