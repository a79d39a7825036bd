/* What was measured of a material, in the coordinates of Dupuy and Jakob 2018 (clpt/measured/measurement.py).
 * `values` has from `first` on the numbers of MEASUREMENT_HEAD, phi_i and theta_i as `warp_node` reads them, the
 * share that each colour reflects, ndf, sigma, the slices of vndf and of luminance, and the spectra: of every
 * phi_i, pair of neighbouring colours, row and column those of every theta_i, two halves in a word
 * (clpt/render/spectra/measurements.py). */
#include "materials/warp_table.cl"
#define MEASUREMENT_HEAD 17
#ifndef MEASUREMENT_COUNT /* where all measurements of a scene have the same, these are constants */
#define MEASUREMENT_COUNT(t, i) warp_count((t).values, (t).first, i)
#endif

typedef struct {
    global const float *values;
    integer first; /* above 0 */
    Spectrum row; /* which of the colours each wavelength has, with a fraction */
} Measurement;

/* Numbers over the corners of a grid. */
typedef struct {
    integer first, rows, columns;
} GridTable;

/* Where its parts begin. */
typedef struct {
    integer phis, thetas;         /* how many viewers, and where their angles stand */
    integer phi_i, theta_i, phi_cells, theta_cells, albedo;
    GridTable ndf, sigma;
    WarpTable vndf, luminance;
    integer spectra, colours;
    mask isotropic, over_density; /* whether spectra are over ndf / (4 sigma) */
    integer reduction;            /* equal parts of the azimuths; a single part is stored */
} MeasurementParts;

inline GridTable measurement_grid(Measurement t, integer first, int i)
{
    return (GridTable){first, MEASUREMENT_COUNT(t, i), MEASUREMENT_COUNT(t, i + 1)};
}
inline WarpTable measurement_warp(Measurement t, integer first, int i, int unit)
{
    return (WarpTable){t.values, first, MEASUREMENT_COUNT(t, 1), MEASUREMENT_COUNT(t, i), MEASUREMENT_COUNT(t, i + 1),
                       gather(t.values, t.first + unit)};
}

inline MeasurementParts measurement_parts(Measurement t)
{
    MeasurementParts p;
    p.phis = MEASUREMENT_COUNT(t, 0);
    p.thetas = MEASUREMENT_COUNT(t, 1);
    p.phi_i = t.first + MEASUREMENT_HEAD;
    p.phi_cells = MEASUREMENT_COUNT(t, 12);
    p.theta_cells = MEASUREMENT_COUNT(t, 13);
    p.theta_i = p.phi_i + p.phi_cells + p.phis;
    p.albedo = p.theta_i + p.theta_cells + p.thetas;
    p.colours = MEASUREMENT_COUNT(t, 10);
    p.ndf = measurement_grid(t, p.albedo + p.colours, 2);
    p.sigma = measurement_grid(t, p.ndf.first + p.ndf.rows * p.ndf.columns, 4);
    p.vndf = measurement_warp(t, p.sigma.first + p.sigma.rows * p.sigma.columns, 6, 15);
    p.luminance = measurement_warp(t, p.vndf.first + p.phis * warp_stride(p.vndf), 8, 16);
    p.spectra = p.luminance.first + p.phis * warp_stride(p.luminance);
    integer flags = MEASUREMENT_COUNT(t, 11);
    p.over_density = (flags & 1) != 0;
    p.reduction = flags >> 1;
    p.isotropic = p.phis <= 2;
    return p;
}

/* A grid's bilinear value. */
inline real measurement_at(global const float *values, GridTable t, vec2 p)
{
    real x, y;
    integer column = warp_cell(p.x, t.columns, &x), row = warp_cell(p.y, t.rows, &y);
    integer at = t.first + row * t.columns + column;
    vec2 c = warp_mixed(gather2(values, at), gather2(values, at + t.columns), y);
    return c.x + x * (c.y - c.x);
}

/* Turns or mirrors w as `wo` must be turned to reach the stored part of the azimuths. Applied twice it returns w. */
inline vec3 measurement_folded(MeasurementParts p, vec3 wo, vec3 w)
{
    mask turns = (p.reduction >= 2) & (wo.y >= 0.0f);
    mask mirrors = sel_i(p.reduction == 4, (p.reduction == 4) & (wo.x >= 0.0f), turns);
    return v3(sel(mirrors, -w.x, w.x), sel(turns, -w.y, w.y), w.z);
}

/* The viewers around wo. */
inline WarpSlices measurement_viewers(MeasurementParts p, global const float *values, vec2 wo)
{
    WarpSlices s;
    real t, f = 0.0f;
    integer theta = warp_node(values, p.theta_i, p.theta_cells, p.thetas, 0.5f * PI * wo.x * wo.x, &t), phi = 0;
    s.wide = p.phis > 1;
    if (any(s.wide)) phi = warp_node(values, p.phi_i, p.phi_cells, p.phis, (2.0f * wo.y - 1.0f) * PI, &f);
    s.slice = theta;
    s.near = phi;
    s.far = min_i(phi + 1, p.phis - 1);
    s.share.x = (1.0f - t) * (1.0f - f);
    s.share.y = t * (1.0f - f);
    s.beyond.x = (1.0f - t) * f;
    s.beyond.y = t * f;
    return s;
}

/* The spectra at a point of the second square. */
inline Spectrum measurement_spectrum(Measurement t, MeasurementParts p, WarpSlices s, vec2 u)
{
    real x, y, scale = gather(t.values, t.first + 14);
    integer column = warp_cell(u.x, p.luminance.columns, &x), row = warp_cell(u.y, p.luminance.rows, &y);
    integer pairs = max_i(p.colours - 1, (integer)(1)), nodes = p.luminance.rows * p.luminance.columns * p.thetas;
    integer width = p.luminance.columns * p.thetas, stride = pairs * nodes;
    integer first = p.spectra + row * width + column * p.thetas;
#define NODE(at) warp_read_halves(t.values, s, at, stride)
#define PAIR(at)                                               \
    warp_mixed(warp_mixed(NODE(at), NODE((at) + p.thetas), x), \
               warp_mixed(NODE((at) + width), NODE((at) + width + p.thetas), x), y)
    Spectrum r;
#if SPECTRUM_SIZE == 4
#define C(c)                                                            \
    {                                                                   \
        integer colour = clamp_i(to_integer(t.row.c), pairs - 1);       \
        vec2 both = PAIR(first + colour * nodes);                       \
        r.c = both.x + (t.row.c - to_real(colour)) * (both.y - both.x); \
    }
    SPECTRUM_EACH(C)
#undef C
#else
    vec2 near = PAIR(first), far = PAIR(first + nodes);
    r.x = near.x;
    r.y = near.y;
    r.z = far.y;
#endif
#undef PAIR
#undef NODE
    return spectrum_scale(r, scale * 0x1p112f);
}

/* The share of light that is reflected to the first viewer. */
inline Spectrum measurement_share(Measurement t)
{
    MeasurementParts p = measurement_parts(t);
    Spectrum r;
#define C(c)                                                                                  \
    {                                                                                         \
        integer colour = min_i(to_integer(t.row.c), max_i(p.colours - 2, (integer)(0)));      \
        integer at = p.albedo + colour, beside = min_i(p.colours - 1 - colour, (integer)(1)); \
        real a = gather(t.values, at), b = gather(t.values, at + beside);                     \
        r.c = a + (t.row.c - to_real(colour)) * (b - a);                                      \
    }
    SPECTRUM_EACH(C)
#undef C
    return r;
}

/* Step load: a Measurement from its six words in `materials`: the first of its numbers in `distributions`, and a
 * spectrum that says which of its colours each wavelength has. In RGB mode there are three. */
inline Measurement measurement_load(Scene scene, integer at, Wavelengths lambdas)
{
    Measurement t;
    t.values = scene.distributions;
    t.first = gather_i(scene.materials, at);
#if SPECTRUM_SIZE == 4
    vec4 words = v4((real)(0.0f), (real)(0.0f), (real)(0.0f), gather_w(scene.materials, at + 4));
    t.row = spectrum_table(scene, words, gather_i(scene.materials, at + 5), lambdas);
#else
    t.row.x = (real)(0.0f);
    t.row.y = (real)(1.0f);
    t.row.z = (real)(2.0f);
#endif
    return t;
}
