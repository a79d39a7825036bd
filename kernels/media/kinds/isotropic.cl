/* The same in all directions: 1 / (4 pi). */
BsdfSample isotropic_sample(Isotropic m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    vec2 point = {u.x, u.y};
    s.wi = uniform_sphere(point);
    s.weight = spectrum_of(1.0f);
    s.pdf = 0.25f * INV_PI;
    s.lobe = LOBE_TRANSMIT;
    return s;
}

Spectrum isotropic_eval(Isotropic m, vec3 wo, vec3 wi) { return spectrum_of(0.25f * INV_PI); }

real isotropic_pdf(Isotropic m, vec3 wo, vec3 wi) { return 0.25f * INV_PI; }

Spectrum isotropic_albedo(Isotropic m) { return spectrum_of(1.0f); }
