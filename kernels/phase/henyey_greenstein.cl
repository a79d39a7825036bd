/* Henyey and Greenstein 1941: (1 - g^2) / (4 pi (1 + g^2 - 2 g cos)^1.5), cos of the angle by which light turns. It
 * is sampled by the inverse of its integral (Pharr, Jakob and Humphreys 2023, 11.3.1). */
real henyey_greenstein_pdf(HenyeyGreenstein m, vec3 wo, vec3 wi)
{
    real g = m.g, turn = -dot3(wo, wi);
    real below = max_r(1.0f + g * g - 2.0f * g * turn, (real)(1e-12f));
    return 0.25f * INV_PI * (1.0f - g * g) / (below * sqrt(below));
}

Spectrum henyey_greenstein_eval(HenyeyGreenstein m, vec3 wo, vec3 wi)
{
    return spectrum_of(henyey_greenstein_pdf(m, wo, wi));
}

BsdfSample henyey_greenstein_sample(HenyeyGreenstein m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    mask even = fabs(m.g) < 1e-3f;
    real g = sel(even, (real)(1.0f), m.g);
    real root = (1.0f - g * g) / (1.0f + g - 2.0f * g * u.x);
    real turn = clamp_r((1.0f + g * g - root * root) / (2.0f * g), (real)(-1.0f), (real)(1.0f));
    real z = sel(even, 1.0f - 2.0f * u.x, turn), r = sqrt_r(1.0f - z * z);
    real sine, cosine;
    sincos_2pi(u.y, &sine, &cosine);
    s.wi = v3(r * cosine, r * sine, -z);
    s.weight = spectrum_of(1.0f);
    s.pdf = henyey_greenstein_pdf(m, wo, s.wi);
    s.lobe = LOBE_TRANSMIT;
    return s;
}

Spectrum henyey_greenstein_albedo(HenyeyGreenstein m) { return spectrum_of(1.0f); }
