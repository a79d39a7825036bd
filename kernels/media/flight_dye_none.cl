/* Stands for media/flight_dye.cl where no medium has a dye. */
typedef integer FlightDye;
#define flight_dye(name, m, end, scatters, u) ((integer)(0))
#define flight_dye_end(f, t) (t)
#define flight_dye_pdf(f, t, collides, pdf) (pdf)
