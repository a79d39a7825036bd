/* A rough dielectric boundary over a diffuse base: how much light passes it, and how much of the base's light it
 * throws back. Isotropic microfacets of roughness alpha; eta: index of the coat over outside. From 1 on the
 * integrals stand in tables, linear in the roots of alpha and of 1 - 1 / eta: within 0.01 of float64 sums for an
 * index of 1.2 to 3, where grazing light meets an index below 1 within 0.05; what a smooth coat throws back of a
 * metal's light within 0.01 in the mean, near the critical angle of a smooth metal within 0.07. */
#include "materials/coat_cell.cl"
#include "generated/rough_coat_table.cl"

/* The share that a smooth boundary lets through, cos_i > 0. */
inline real coat_smooth(real c, real eta)
{
    real inv = 1.0f / eta, t = sqrt_r(1.0f - (1.0f - c * c) * inv * inv); /* cosine of refraction */
    real s = c + eta * t, p = eta * c + t;
    return 2.0f * eta * c * t * (s * s + p * p) / max_r(sqr(s * p), (real)(1e-20f)); /* 1 - F */
}

/* Radii of three normals' slopes, in units of alpha, and their weights: Gauss-Legendre in
 * v = sqrt(1 - u), where u is the share of projected area with smaller slopes; four azimuths each. */
constant float coat_radius_ggx[3] = {0.519775f, 1.732051f, 8.816453f};
constant float coat_radius_beckmann[3] = {0.489028f, 1.177410f, 2.089504f};
constant float coat_weight[3] = {0.492944f, 0.444444f, 0.062612f};
constant float coat_azimuth[4] = {0.923880f, 0.382683f, -0.382683f, -0.923880f};

/* The transmittance of a coat of lower index than outside, summed over these nodes, with an error below
 * 0.015. Nothing is tabulated for it: light beyond the critical angle makes edges. */
called real coat_transmittance_thinner(Microfacets d, real cos_i, real eta)
{
    real sin_i = sqrt_r(1.0f - cos_i * cos_i), inv = 1.0f / eta, a2 = sqr(d.alpha_u), sum = 0.0f, seen = 1e-20f;
    ROLLED
    for (int i = 0; i < 3; ++i) {
        real radius = sel(d.beckmann, (real)(coat_radius_beckmann[i]), (real)(coat_radius_ggx[i])) * d.alpha_u;
        real cos_h = 1.0f / sqrt(1.0f + radius * radius), lean = sin_i * radius;
        ROLLED
        for (int j = 0; j < 4; ++j) {
            real area = max_r(cos_i + lean * coat_azimuth[j], (real)(0.0f));
            real c = min_r(area * cos_h, (real)(1.0f));
            real t = sqrt_r(1.0f - (1.0f - c * c) * inv * inv), passed = coat_smooth(c, eta);
            real z = max_r(cos_i * inv + (t - c * inv) * cos_h, (real)(0.0f)); /* how far down it then goes */
            real spread = sqrt_r(a2 * (1.0f - z * z)), w = z / max_r(spread, (real)(1e-20f));
            real ggx = 2.0f * z / (z + sqrt(z * z + spread * spread) + 1e-20f);
            real beckmann = w * (3.535f + 2.181f * w) / (1.0f + w * (2.276f + 2.577f * w));
            real g1 = sel(d.beckmann, sel(w < 1.6f, beckmann, (real)(1.0f)), ggx);
            area *= coat_weight[i];
            sum += area * passed * g1;
            seen += area;
        }
    }
    return sum / seen;
}
/* Mean over the normals that cos_i > 0 sees of (1 - F) G1(refracted direction): the transmittance that
 * Mitsuba 3 tabulates. Here its ratio to a smooth coat's, at a cosine that stands for the facets', is. */
inline real coat_transmittance(Microfacets d, real cos_i, real eta)
{
    CoatCell cell = coat_cell(d, eta);
    real c2 = cos_i * cos_i, facing = sqrt(c2 + sqr(d.alpha_u) * max_r(1.0f - c2, (real)(0.0f)));
    real x = (1.0f - sqrt_r(1.0f - cos_i / facing)) * (float)(COAT_COSINES - 1);
    integer k = clamp_i(to_integer(x), (integer)(COAT_COSINES - 2));
    real ratio = COAT_PASSED_UNIT * coat_look_up_by(coat_passed, COAT_COSINES, cell, k, x - to_real(k));
    real passed = min_r(ratio * coat_smooth(facing, eta), (real)(1.0f));
    if (any(eta < 1.0f)) passed = sel(eta < 1.0f, coat_transmittance_thinner(d, cos_i, eta), passed);
    return passed;
}
/* That of a wavelength apart: few coats disperse, and their text stands once. */
called real coat_transmittance_apart(Microfacets d, real cos_i, real eta) { return coat_transmittance(d, cos_i, eta); }
inline Spectrum coat_transmittance_spectrum(Microfacets d, real cos_i, Spectrum eta)
{
    Spectrum t = spectrum_of(coat_transmittance(d, cos_i, eta.x));
    if (any(spectrum_varies(eta))) {
#define C(c) SPECTRUM_PUT(t, c, coat_transmittance_apart(d, cos_i, SPECTRUM_AT(eta, c)));
        SPECTRUM_IN_TURN(C)
#undef C
    }
    return t;
}

/* What the coat reflects of a diffuse light below it, less what facets mask, as Mitsuba 3 sums it. */
inline real coat_inside_reflectance(Microfacets d, real eta)
{
    real inside = COAT_INSIDE_UNIT * coat_look_up(coat_inside, coat_cell(d, eta));
    return sel(eta > 1.0f, inside, fresnel_diffuse(1.0f / eta));
}

inline Spectrum coat_inside_reflectance_spectrum(Microfacets d, Spectrum eta)
{
    Spectrum r = spectrum_of(coat_inside_reflectance(d, eta.x));
    if (any(spectrum_varies(eta))) {
#define C(c) SPECTRUM_PUT(r, c, coat_inside_reflectance(d, SPECTRUM_AT(eta, c)));
        SPECTRUM_IN_TURN(C)
#undef C
    }
    return r;
}

/* What leaves facets d that reflect all, of light of the cosine that is usual within a coat. */
inline real coat_bounced(Microfacets d)
{
    CoatCell cell = coat_cell(d, (real)(1.0f));
    integer at = cell.row - sel_i(d.beckmann, (integer)(1), (integer)(0)); /* the last roughness begins no pair */
    return COAT_BOUNCE_UNIT * coat_pair(coat_bounce, at, cell.by_alpha);
}
/* Of light that comes at cosine cos_i > 0 to a smooth coat over such facets: what they send up and the coat throws
 * back. */
inline real coat_thrown_back(Microfacets d, real cos_i, real eta)
{
    CoatCell cell = coat_cell(d, eta);
    real x = sqrt(cos_i) * (float)(COAT_STEEPS - 1), a2 = sqr(sqr(cell.by_alpha));
    integer k = clamp_i(to_integer(x), (integer)(COAT_STEEPS - 2));
    mask smooth = d.alpha_u < 1.0f / ((COAT_ALPHAS - 1) * (COAT_ALPHAS - 1)); /* few slopes are far: by alpha^2 */
    cell.by_alpha = sel(smooth, a2, cell.by_alpha);
    real more = COAT_THROWN_UNIT * coat_look_up_by(coat_thrown, COAT_STEEPS, cell, k, x - to_real(k));
    return max_r(more - coat_smooth(cos_i, eta), (real)(0.0f));
}
