/* Steps of a flight through a medium (stage/flight.cl) that depend on the kinds of media. */

/* Step medium: the medium of a ray among bodies, which its path stores. A body of higher priority hides a surface
 * inside of it: the hit becomes a null surface. */
inline integer flight_medium(Scene scene, Slab path, Slab hit, uint at, mask alive, mask met)
{
    integer shape = sel_i(met, load_hit_shape(hit, at), (integer)(0));
    mask front = dot3(load_hit_n(hit, at), load_path_d(path, at)) < 0.0f;
    BodyBoundary boundary = body_boundary(scene, shape, load_path_bodies(path, at), front);
    store_hit_material(hit, at, met & boundary.hidden, body_word(scene, (integer)(0), 0));
    return load_path_medium(path, at);
}

/* Twin, where bodies do not overlap: a ray without a medium takes that of the side of the surface that it hits. */
inline integer flight_medium(Scene scene, Slab path, Slab hit, uint at, mask alive, mask met)
{
    ShapeMedia own = shape_media(scene, sel_i(met, load_hit_shape(hit, at), (integer)(0)));
    mask front = dot3(load_hit_n(hit, at), load_path_d(path, at)) < 0.0f;
    integer medium = load_path_medium(path, at);
    integer name = sel_i(met & (medium == 0), sel_i(front, own.outside, own.inside), medium);
    store_path_medium(path, at, alive, name);
    return name;
}

/* Step grids: distance sampling in media on grids, which replaces that in homogeneous media. */

/* No flight in a grid aims at a lamp (media/equiangular.cl). */
inline real flight_near_share(integer name, real share) { return sel((name & MEDIUM_GRID) != 0, (real)(0.0f), share); }

inline void flight_grids(Scene scene, Slab path, uint at, mask flies, integer name, FlightRay r, Spectrum ratio,
                         Wavelengths lambdas, Spectrum *light, Spectrum *weight, mask *collides, real *t, Medium *m)
{
    mask gridded = flies & ((name & MEDIUM_GRID) != 0);
    if (any(gridded)) {
        natural key = grid_key(scene, load_path_pixel_key(path, at), load_path_sample(path, at), r.vertex);
        GridFlight own = grid_flight(scene, name, *m, r.o, r.d, r.end, ratio, r.u, key, gridded, lambdas, path,
                                     at);
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

/* Step weight: the weight of a flight over all wavelengths of its path; f: transmittance, times scattering at a
 * collision; pdf: of the distance at each wavelength. */
inline Spectrum flight_weight(Slab path, uint at, mask flies, Spectrum ratio, Spectrum f, Spectrum pdf)
{
    Spectrum pdfs = spectrum_mul(ratio, pdf);
    real mean = spectrum_mean(pdfs), inverse = sel(mean > 1e-30f, 1.0f / mean, (real)(0.0f));
    store_path_ratio(path, at, flies, spectrum_scale(pdfs, inverse));
    return spectrum_scale(f, inverse);
}

/* Twin, where extinction is the same at all wavelengths. */
inline Spectrum flight_weight(Slab path, uint at, mask flies, Spectrum ratio, Spectrum f, Spectrum pdf)
{
    return spectrum_scale(f, 1.0f / max_r(pdf.x, (real)(1e-30f)));
}

/* Step emission: emission of homogeneous media along a flight. */
#include "generated/light_of_flight.cl"
#include "generated/body_weight.cl"

inline Spectrum flight_emission(Scene scene, mask flies, integer name, Medium m, real end, Wavelengths lambdas)
{
    return medium_emission(scene, sel_i(flies, name, (integer)(0)), m, end, lambdas);
}

/* Adds it to the radiance of the path. */
inline void flight_light(Scene scene, Slab path, uint at, mask flies, integer state, Spectrum light FLIGHT_ARGS)
{
    light = spectrum_mul(load_path_beta(path, at), emission_mis_weighted(scene, path, at, flies, light));
    store_path_radiance(path, at, flies, spectrum_add(load_path_radiance(path, at), light));
    flight_light_layers(scene, path, at, flies, state, light FLIGHT_PASSED);
}

/* Twin, where no medium emits. */
inline Spectrum flight_emission(Scene scene, mask flies, integer name, Medium m, real end, Wavelengths lambdas)
{
    return spectrum_of(0.0f);
}
inline void flight_light(Scene scene, Slab path, uint at, mask flies, integer state, Spectrum light FLIGHT_ARGS) {}

/* Step emission_weight: emission gathered along a ray in a homogeneous medium, weighted (MIS) against next-event
 * estimation. */
inline Spectrum emission_mis_weighted(Scene scene, Slab path, uint at, mask flies, Spectrum light)
{
    integer row = medium_light_row(scene, sel_i(flies, load_path_medium(path, at), (integer)(0)));
    real pdf = load_path_pdf(path, at);
    mask sought = flies & (row > 0) & (pdf >= 0.0f);
    if (any(sought)) {
        vec3 d = load_path_d(path, at), from = madd3(d, -load_path_null_distance(path, at), load_path_o(path, at));
        real own = body_light_pdf(scene, sel_i(sought, row - 1, (integer)(0)), from, path_receiver(path, at), d);
        light = spectrum_scale(light, sel(sought, mis_weight(pdf, own), (real)(1.0f)));
    }
    return light;
}

/* Twin, where no homogeneous medium is a light. */
inline Spectrum emission_mis_weighted(Scene scene, Slab path, uint at, mask flies, Spectrum light) { return light; }

/* Step light_layers: adds emission of media to its light layers, whose group follows the groups of all lights. */
#include "film/light_layers.cl"

inline void flight_light_layers(Scene scene, Slab path, uint at, mask flies, integer state, Spectrum light FLIGHT_ARGS)
{
    integer row = scene.settings->light_count;
    light_layers_add(scene, path, at, flies, state & PATH_DEPTH, row, (real)(0.0f), light LIGHT_LAYER_PASSED);
}

/* Twin, where the film has no layers of lights. */
inline void flight_light_layers(Scene scene, Slab path, uint at, mask flies, integer state,
                                Spectrum light FLIGHT_ARGS) {}

/* Step dye: distance sampling in media with a dye. Where the dye emits at wavelengths that it does not absorb,
 * extinction tells little of where it emits. The share DYE_SHARE of the flights takes its distance from another
 * density, which never goes beyond the end of the ray. A strong dye is lit where light comes in: most of these flights
 * end near either end of the ray, and the share DYE_EVEN anywhere. All densities are combined by MIS (balance
 * heuristic). */
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
