/* What was measured of a material, in the coordinates of Dupuy and Jakob 2018 (clpt/measured/measurement.py).
 * `values` has from `first` on the numbers of MEASUREMENT_HEAD, phi_i and theta_i as `warp_node` reads them, the
 * share that each colour reflects, ndf, sigma, the slices of vndf and of luminance, and the spectra: of every
 * viewer, row and column all pairs of neighbouring colours, as two halves in a word
 * (clpt/render/lowering/materials/measurements.py). */
#include "optics/halfway_square.cl"
#include "optics/warp_table.cl"
#define MEASUREMENT_HEAD 15
#ifndef MEASUREMENT_COUNT /* where all measurements of a scene have the same, these are constants */
#define MEASUREMENT_COUNT(t, i) warp_count((t).values, (t).first, i)
#endif

typedef struct {
    global const float *values;
    integer first; /* above 0 */
    Spectrum row; /* which of the colours each wavelength has, with a fraction */
} Measurement;

/* Where its parts begin. */
typedef struct {
    integer phis, thetas;         /* how many viewers, and where their angles stand */
    integer phi_i, theta_i, phi_cells, theta_cells, albedo;
    WarpTable ndf, sigma;         /* of which there are densities alone */
    WarpTable vndf, luminance;
    integer spectra, colours;
    mask isotropic, over_density; /* whether spectra are over ndf / (4 sigma) */
    integer reduction;            /* of how many equal parts of the azimuths one is stored */
} MeasurementParts;

inline WarpTable measurement_table(Measurement t, integer first, integer rows, integer columns)
{
    WarpTable r = {t.values, first, rows, columns};
    return r;
}
#define MEASUREMENT_TABLE(t, first, i) \
    measurement_table(t, first, MEASUREMENT_COUNT(t, i), MEASUREMENT_COUNT(t, i + 1))

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
    p.ndf = MEASUREMENT_TABLE(t, p.albedo + p.colours, 2);
    p.sigma = MEASUREMENT_TABLE(t, p.ndf.first + p.ndf.rows * p.ndf.columns, 4);
    p.vndf = MEASUREMENT_TABLE(t, p.sigma.first + p.sigma.rows * p.sigma.columns, 6);
    integer viewers = p.phis * p.thetas;
    p.luminance = MEASUREMENT_TABLE(t, p.vndf.first + viewers * warp_stride(p.vndf), 8);
    p.spectra = p.luminance.first + viewers * warp_stride(p.luminance);
    integer flags = MEASUREMENT_COUNT(t, 11);
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
    integer theta = warp_node(values, p.theta_i, p.theta_cells, p.thetas, 0.5f * PI * wo.x * wo.x, &t), phi = 0;
    s.wide = p.phis > 1;
    if (any(s.wide)) phi = warp_node(values, p.phi_i, p.phi_cells, p.phis, (2.0f * wo.y - 1.0f) * PI, &f);
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

/* A pair of halves, which are not negative, times 2^-112. */
inline vec2 measurement_halves(real word)
{
    natural bits = as_natural(word);
    vec2 r = {as_real((bits & 0x7fffu) << 13), as_real((bits >> 16 & 0x7fffu) << 13)};
    return r;
}
inline vec2 measurement_mixed(vec2 a, vec2 b, real along)
{
    vec2 r = {a.x + along * (b.x - a.x), a.y + along * (b.y - a.y)};
    return r;
}

/* Two neighbouring colours of a node, of all slices. */
inline vec2 measurement_pair(global const float *values, WarpSlices s, integer at, integer stride)
{
    vec2 sum = {(real)(0.0f), (real)(0.0f)};
    int slices = any(s.wide) ? 4 : 2;
    for (int i = 0; i < slices; i++) {
        vec2 one = measurement_halves(gather(values, at + s.index[i] * stride));
        sum.x += s.share[i] * 0x1p112f * one.x;
        sum.y += s.share[i] * 0x1p112f * one.y;
    }
    return sum;
}

/* The spectra at a point of the second square. */
inline Spectrum measurement_spectrum(Measurement t, MeasurementParts p, WarpSlices s, vec2 u)
{
    real x, y, scale = gather(t.values, t.first + 14);
    integer column = warp_cell(u.x, p.luminance.columns, &x), row = warp_cell(u.y, p.luminance.rows, &y);
    integer pairs = max_i(p.colours - 1, (integer)(1)), width = p.luminance.columns * pairs;
    integer stride = p.luminance.rows * width, first = p.spectra + row * width + column * pairs;
#define NODE(at) measurement_pair(t.values, s, at, stride)
#define PAIR(at)                                                          \
    measurement_mixed(measurement_mixed(NODE(at), NODE((at) + pairs), x), \
                      measurement_mixed(NODE((at) + width), NODE((at) + width + pairs), x), y)
    Spectrum r;
#if SPECTRUM_SIZE == 4
#define C(c)                                                            \
    {                                                                   \
        integer colour = clamp_i(to_integer(t.row.c), pairs - 1);       \
        vec2 both = PAIR(first + colour);                               \
        r.c = both.x + (t.row.c - to_real(colour)) * (both.y - both.x); \
    }
    SPECTRUM_EACH(C)
#undef C
#else
    vec2 near = PAIR(first), far = PAIR(first + 1);
    r.x = near.x;
    r.y = near.y;
    r.z = far.y;
#endif
#undef PAIR
#undef NODE
    return spectrum_scale(r, scale);
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
