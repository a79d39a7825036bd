/* Distance sampling in media with a dye. Where the dye emits at wavelengths that it does not absorb, extinction
 * tells little of where it emits. The share DYE_SHARE of the flights takes its distance from another density, which
 * never goes beyond the end of the ray. A strong dye is lit where light comes in: most of these flights end near
 * either end of the ray, and the share DYE_EVEN anywhere. All densities are combined by MIS (balance heuristic). */
#define DYE_SHARE 0.5f
#define DYE_EVEN 0.2f    /* share of these flights whose distance is uniform */
#define DYE_TAKES 2.0f   /* roughly the largest absorption of a dye over its largest emission */
#define DYE_FAINT 1e-5f  /* optical depth of emission below which no flight ends so */

typedef struct {
    real share, rate, whole; /* rate of the exponential [1/m], and its integral to the end of the ray */
    real end;                /* [m] */
} DyeFlight;

inline DyeFlight dye_flight(integer name, Medium m, real end)
{
    DyeFlight f;
    real most = spectrum_max(spectrum_sub(m.sigma_s, m.sigma_t)); /* emission beyond absorption */
    mask dyed = ((name & MEDIUM_DYED) != 0) & (most * end > DYE_FAINT) & (end < 0.5f * FAR);
    f.share = sel(dyed, (real)(DYE_SHARE), (real)(0.0f));
    f.end = sel(dyed, end, (real)(1.0f));
    f.rate = sel(dyed, DYE_TAKES * most, (real)(1.0f));
    f.whole = 1.0f - exp_r(-min_r(f.rate * f.end, (real)(80.0f)));
    return f;
}

/* A distance [m] for a random number. */
inline real dye_distance(DyeFlight f, real u)
{
    mask even = u < DYE_EVEN;
    real rest = (u - DYE_EVEN) * (2.0f / (1.0f - DYE_EVEN));
    mask back = rest >= 1.0f;
    rest = clamp_r(sel(back, rest - 1.0f, rest), (real)(0.0f), (real)(0.99999994f));
    real t = min_r(-log_r(max_r(1.0f - rest * f.whole, (real)(1e-9f))) / f.rate, f.end);
    return sel(even, u * (1.0f / DYE_EVEN) * f.end, sel(back, f.end - t, t));
}

/* The density of a distance [1/m]. */
inline real dye_pdf(DyeFlight f, real t)
{
    real front = exp_r(-min_r(f.rate * t, (real)(80.0f)));
    real back = exp_r(-min_r(f.rate * max_r(f.end - t, (real)(0.0f)), (real)(80.0f)));
    real near = 0.5f * f.rate * (front + back) / max_r(f.whole, (real)(1e-30f));
    return DYE_EVEN / f.end + (1.0f - DYE_EVEN) * near;
}

typedef struct {
    DyeFlight ends;
    mask glows;  /* the distance comes from the dye */
    real by_dye; /* that distance [m] */
} FlightDye;

/* Chooses the flights by *u, which is rescaled to a new random number. */
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
typedef struct { mask glows; } FlightDye;
inline FlightDye flight_dye(integer name, Medium m, real end, mask scatters,
                            real *u) { FlightDye f = {mask_of(0)}; return f; }
inline real flight_dye_end(FlightDye f, real t) { return t; }
inline Spectrum flight_dye_pdf(FlightDye f, real t, mask collides, Spectrum pdf) { return pdf; }
