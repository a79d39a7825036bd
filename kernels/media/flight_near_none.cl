/* Stands for media/flight_near.cl without lamps in media, and for paths from lamps, which have no reason to stay. */
typedef integer FlightNear;
#define flight_near(scene, sampler, vertex, name, o, d, end, m, scatters, u) ((integer)(0))
#define flight_near_end(n, t) (t)
#define flight_near_pdf(n, t, collides, pdf) (pdf)
