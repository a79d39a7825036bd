/* No surface: light passes as it came. */
BsdfSample null_sample(Null m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    s.wi = neg3(wo);
    s.weight = spectrum_of(1.0f);
    s.pdf = 1.0f;
    s.lobe = LOBE_TRANSMIT | LOBE_DELTA | LOBE_NULL;
    return s;
}

Spectrum null_eval(Null m, vec3 wo, vec3 wi) { return spectrum_of(0.0f); }

real null_pdf(Null m, vec3 wo, vec3 wi) { return 0.0f; }

Spectrum null_albedo(Null m) { return spectrum_of(1.0f); }
