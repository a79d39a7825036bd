/* What was measured of a material, in the coordinates of Dupuy and Jakob 2018 (clpt/measured/measurement.py). `values`
 * has from `first` on the numbers of MEASUREMENT_HEAD, phi_i, theta_i, the share that each colour reflects, ndf, sigma, the slices of vndf and of luminance,
 * and the spectra: of every viewer, row and column all colours (clpt/render/lowering/materials/measurements.py). */
#include "optics/halfway_square.cl"
#include "optics/warp_table.cl"
#define MEASUREMENT_HEAD 12

typedef struct {
    global const float *values;
    integer first; /* above 0 */
    Spectrum row; /* which of the colours each wavelength has, with a fraction */
} Measurement;

/* Where its parts begin. */
typedef struct {
    integer phis, thetas;         /* how many viewers, and where their angles stand */
    integer phi_i, theta_i, albedo;
    WarpTable ndf, sigma;         /* of which there are densities alone */
    WarpTable vndf, luminance;
    integer spectra, colours;
    mask isotropic, over_density; /* whether spectra are over ndf / (4 sigma) */
    integer reduction;            /* of how many equal parts of the azimuths one is stored */
} MeasurementParts;

inline integer measurement_number(Measurement t, int i) { return warp_count(t.values, t.first, i); }

inline WarpTable measurement_table(Measurement t, integer first, int i)
{
    WarpTable r = {t.values, first, measurement_number(t, i), measurement_number(t, i + 1)};
    return r;
}

inline MeasurementParts measurement_parts(Measurement t)
{
    MeasurementParts p;
    p.phis = measurement_number(t, 0);
    p.thetas = measurement_number(t, 1);
    p.phi_i = t.first + MEASUREMENT_HEAD;
    p.theta_i = p.phi_i + p.phis;
    p.albedo = p.theta_i + p.thetas;
    p.colours = measurement_number(t, 10);
    p.ndf = measurement_table(t, p.albedo + p.colours, 2);
    p.sigma = measurement_table(t, p.ndf.first + p.ndf.rows * p.ndf.columns, 4);
    p.vndf = measurement_table(t, p.sigma.first + p.sigma.rows * p.sigma.columns, 6);
    integer viewers = p.phis * p.thetas;
    p.luminance = measurement_table(t, p.vndf.first + viewers * warp_stride(p.vndf), 8);
    p.spectra = p.luminance.first + viewers * warp_stride(p.luminance);
    integer flags = measurement_number(t, 11);
    p.over_density = (flags & 1) != 0;
    p.reduction = flags >> 1;
    p.isotropic = p.phis <= 2;
    return p;
}

/* A single table's bilinear value. */
inline real measurement_at(WarpTable t, vec2 p)
{
    real x, y;
    integer column = warp_cell(p.x, t.columns, &x), row = warp_cell(p.y, t.rows, &y);
    integer at = t.first + row * t.columns + column, below = at + t.columns;
    return warp_between(v4(gather(t.values, at), gather(t.values, at + 1), gather(t.values, below),
                           gather(t.values, below + 1)), x, y);
}

/* Which part of the azimuths is meant: w is turned, or mirrored, as `wo` must be to come to what is stored. Twice the
 * same gives w again. */
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
    integer theta = warp_node(values, p.theta_i, p.thetas, 0.5f * PI * wo.x * wo.x, &t), phi = 0;
    s.wide = p.phis > 1;
    if (any(s.wide)) phi = warp_node(values, p.phi_i, p.phis, (2.0f * wo.y - 1.0f) * PI, &f);
    integer next = min_i(theta + 1, p.thetas - 1), near = phi * p.thetas, far = min_i(phi + 1, p.phis - 1) * p.thetas;
    s.index[0] = near + theta;
    s.index[1] = near + next;
    s.index[2] = far + theta;
    s.index[3] = far + next;
    s.share[0] = (1.0f - t) * (1.0f - f);
    s.share[1] = t * (1.0f - f);
    s.share[2] = (1.0f - t) * f;
    s.share[3] = t * f;
    return s;
}

/* The spectra at a point of the second square. */
inline Spectrum measurement_spectrum(Measurement t, MeasurementParts p, WarpSlices s, vec2 u)
{
    real x, y;
    integer column = warp_cell(u.x, p.luminance.columns, &x), row = warp_cell(u.y, p.luminance.rows, &y);
    integer width = p.luminance.columns * p.colours, stride = p.luminance.rows * width;
    integer first = p.spectra + row * width + column * p.colours;
    Spectrum r;
#define NODE(at)                                                                               \
    warp_between(v4(warp_read(t.values, s, at, stride), warp_read(t.values, s, at + p.colours, stride), \
                    warp_read(t.values, s, at + width, stride),                                \
                    warp_read(t.values, s, at + width + p.colours, stride)), x, y)
#define C(c)                                                                                   \
    {                                                                                          \
        integer colour = min_i(to_integer(t.row.c), max_i(p.colours - 2, (integer)(0)));       \
        real along = t.row.c - to_real(colour);                                                \
        integer at = first + colour;                                                           \
        r.c = NODE(at);                                                                        \
        if (any(along > 0.0f)) {                                                               \
            integer beside = at + min_i(p.colours - 1 - colour, (integer)(1));                 \
            real next = NODE(beside);                                                          \
            r.c += along * (next - r.c);                                                       \
        }                                                                                      \
    }
    SPECTRUM_EACH(C)
#undef C
#undef NODE
    return r;
}

/* The share of light that is reflected to the first viewer. */
inline Spectrum measurement_share(Measurement t)
{
    MeasurementParts p = measurement_parts(t);
    Spectrum r;
#define C(c)                                                                               \
    {                                                                                      \
        integer colour = min_i(to_integer(t.row.c), max_i(p.colours - 2, (integer)(0)));   \
        integer at = p.albedo + colour, beside = min_i(p.colours - 1 - colour, (integer)(1)); \
        real a = gather(t.values, at), b = gather(t.values, at + beside);                  \
        r.c = a + (t.row.c - to_real(colour)) * (b - a);                                   \
    }
    SPECTRUM_EACH(C)
#undef C
    return r;
}
