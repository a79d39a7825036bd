/* Rayleigh 1871: 3 (1 + cos^2) / 16 pi. The cosine is the root of a cubic equation (Frisvad 2011, eq. 6). */
real rayleigh_pdf(Rayleigh m, vec3 wo, vec3 wi)
{
    real turn = dot3(wo, wi);
    return (3.0f / 16.0f) * INV_PI * (1.0f + turn * turn);
}

Spectrum rayleigh_eval(Rayleigh m, vec3 wo, vec3 wi) { return spectrum_of(rayleigh_pdf(m, wo, wi)); }

BsdfSample rayleigh_sample(Rayleigh m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    real v = 4.0f * u.x - 2.0f, root = v + sqrt(v * v + 1.0f);
    real a = pow_r(root, (real)(1.0f / 3.0f));
    real z = clamp_r(a - 1.0f / a, (real)(-1.0f), (real)(1.0f)), r = sqrt_r(1.0f - z * z);
    real sine, cosine;
    sincos_2pi(u.y, &sine, &cosine);
    s.wi = v3(r * cosine, r * sine, z);
    s.weight = spectrum_of(1.0f);
    s.pdf = rayleigh_pdf(m, wo, s.wi);
    s.lobe = LOBE_TRANSMIT;
    return s;
}

Spectrum rayleigh_albedo(Rayleigh m) { return spectrum_of(1.0f); }
