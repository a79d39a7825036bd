/* A rough dielectric boundary over a diffuse base: how much light passes it, and how much of the base's
 * light it throws back. Isotropic microfacets of roughness alpha; eta: index of the coat over outside. */

/* Radii of three normals' slopes, in units of alpha, and their weights: Gauss-Legendre in
 * v = sqrt(1 - u), where u is the share of projected area with smaller slopes; four azimuths each. */
constant float coat_radius_ggx[3] = {0.519775f, 1.732051f, 8.816453f};
constant float coat_radius_beckmann[3] = {0.489028f, 1.177410f, 2.089504f};
constant float coat_weight[3] = {0.492944f, 0.444444f, 0.062612f};
constant float coat_azimuth[4] = {0.923880f, 0.382683f, -0.382683f, -0.923880f};

/* Mean over the normals that cos_i > 0 sees of (1 - F) G1(refracted direction): the transmittance that
 * Mitsuba 3 tabulates. Off by less than 0.015, weighted by the cosine by less than 0.002. */
inline real coat_transmittance(Microfacets d, real cos_i, real eta)
{
    real sin_i = sqrt_r(1.0f - cos_i * cos_i), inv = 1.0f / eta, a2 = sqr(d.alpha_u), sum = 0.0f, seen = 1e-20f;
    for (int i = 0; i < 3; ++i) {
        real radius = sel(d.beckmann, (real)(coat_radius_beckmann[i]), (real)(coat_radius_ggx[i])) * d.alpha_u;
        real cos_h = 1.0f / sqrt(1.0f + radius * radius), lean = sin_i * radius;
        for (int j = 0; j < 4; ++j) {
            real area = max_r(cos_i + lean * coat_azimuth[j], (real)(0.0f));
            real c = min_r(area * cos_h, (real)(1.0f));
            real t = sqrt_r(1.0f - (1.0f - c * c) * inv * inv); /* cosine of refraction */
            real s = c + eta * t, p = eta * c + t;
            real passed = 2.0f * eta * c * t * (s * s + p * p) / max_r(sqr(s * p), (real)(1e-20f)); /* 1 - F */
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
inline Spectrum coat_transmittance_spectrum(Microfacets d, real cos_i, Spectrum eta)
{
    Spectrum t = spectrum_of(coat_transmittance(d, cos_i, eta.x));
    if (any(spectrum_varies(eta))) {
#define C(c) t.c = coat_transmittance(d, cos_i, eta.c);
        SPECTRUM_EACH(C)
#undef C
    }
    return t;
}

/* What the coat reflects of a diffuse light below it, less what facets mask, as Mitsuba 3 sums it: a
 * smooth boundary's share times an exponential, fitted to quadrature for alpha in [0, 1]. 1 - share is
 * off by up to 0.5% for eta in [1.3, 1.85] and 3% in [1.1, 2.5]. */
inline real coat_inside_reflectance(Microfacets d, real eta)
{
    real a = d.alpha_u, y = 1.0f / eta;
    real ggx = -1.0320f + y * (3.4696f - y * 3.5176f) + a * (-1.8657f + y * (2.8563f - y * 9.7599f)
               + a * (2.2998f + y * (-7.5260f + y * 17.3763f) + a * (-0.8902f + y * (3.5916f - y * 8.0089f))));
    real beckmann = -0.4678f + y * (1.3983f - y * 1.0604f) + a * (-0.3797f + y * (2.5197f - y * 5.6052f)
               + a * (-1.2889f + y * (2.2252f - y * 0.6683f) + a * (1.2692f + y * (-4.0330f + y * 4.0367f))));
    real fit = 0.987f * fresnel_diffuse(y) * exp_r(a * sel(d.beckmann, beckmann, ggx));
    return sel(eta > 1.0f, fit, fresnel_diffuse(y));
}
