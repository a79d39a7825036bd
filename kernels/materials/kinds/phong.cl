/* Modified Phong, front side (Lafortune and Willems 1994 eq. 6): f = kd / pi + ks (n + 2) / (2 pi)
 * cos^n a [1/sr], a the angle between wi and the mirror direction of wo. Sums of albedos above 1 are
 * scaled down, wavelength by wavelength. */

/* cos^n a, 0 beyond a right angle. */
inline real phong_lobe(Phong m, vec3 wo, vec3 wi)
{
    real c = min_r(dot3(reflect_z(wo), wi), (real)(1.0f));
    return sel(m.exponent == 0.0f, sel(c > 0.0f, (real)(1.0f), (real)(0.0f)), pow_r(c, m.exponent));
}

Spectrum phong_eval(Phong m, vec3 wo, vec3 wi)
{
    real lobe = phong_lobe(m, wo, wi) * (m.exponent + 2.0f) * INV_2PI;
    Spectrum f = spectrum_madd(m.specular, lobe, spectrum_scale(m.diffuse, (real)(INV_PI)));
    mask front = (wo.z > 0.0f) & (wi.z > 0.0f);
    return spectrum_scale(spectrum_mul(f, two_lobes_scale(m.diffuse, m.specular)), sel(front, wi.z, (real)(0.0f)));
}

real phong_pdf(Phong m, vec3 wo, vec3 wi)
{
    real lobe = phong_lobe(m, wo, wi) * (m.exponent + 1.0f) * INV_2PI;
    real p = two_lobes_probability(m.diffuse, m.specular);
    real pdf = p * lobe + (1.0f - p) * cosine_hemisphere_pdf(wi.z);
    return sel((wo.z > 0.0f) & (wi.z > 0.0f), pdf, (real)(0.0f));
}

BsdfSample phong_sample(Phong m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    vec2 uv = {u.x, u.y};
    real sin_p, cos_p, c = pow_r(1.0f - u.x, 1.0f / (m.exponent + 1.0f)), r = sqrt_r(1.0f - c * c);
    sincos_2pi(u.y, &sin_p, &cos_p);
    vec3 lobe = to_world(frame_of(reflect_z(wo)), v3(r * cos_p, r * sin_p, c));
    s.wi = sel3(u.z < two_lobes_probability(m.diffuse, m.specular), lobe, cosine_hemisphere(uv));
    s.pdf = phong_pdf(m, wo, s.wi);
    s.weight = spectrum_scale(phong_eval(m, wo, s.wi), sel(s.pdf > 0.0f, 1.0f / s.pdf, (real)(0.0f)));
    return s;
}

Spectrum phong_albedo(Phong m)
{
    return spectrum_mul(spectrum_add(m.diffuse, m.specular), two_lobes_scale(m.diffuse, m.specular));
}
