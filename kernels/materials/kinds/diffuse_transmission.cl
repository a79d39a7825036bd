/* Lambertian scattering to both sides: f = reflectance / pi on the side of wo, transmittance / pi on
 * the other [1/sr]. A sum of both above 1 is scaled down, wavelength by wavelength. */

/* The albedo toward the side of wi. */
inline Spectrum diffuse_transmission_share(DiffuseTransmission m, mask crossed)
{
    Spectrum share = spectrum_sel(crossed, m.transmittance, m.reflectance);
    return spectrum_mul(share, two_lobes_scale(m.reflectance, m.transmittance));
}

real diffuse_transmission_pdf(DiffuseTransmission m, vec3 wo, vec3 wi)
{
    real p = two_lobes_probability(m.reflectance, m.transmittance);
    real share = sel(wo.z * wi.z < 0.0f, p, 1.0f - p);
    return sel(wo.z * wi.z != 0.0f, share * fabs(wi.z) * INV_PI, (real)(0.0f));
}

Spectrum diffuse_transmission_eval(DiffuseTransmission m, vec3 wo, vec3 wi)
{
    Spectrum share = diffuse_transmission_share(m, wo.z * wi.z < 0.0f);
    return spectrum_scale(share, sel(wo.z * wi.z != 0.0f, fabs(wi.z) * INV_PI, (real)(0.0f)));
}

BsdfSample diffuse_transmission_sample(DiffuseTransmission m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    vec2 uv = {u.x, u.y};
    real p = two_lobes_probability(m.reflectance, m.transmittance);
    mask crossed = u.z < p;
    s.wi = cosine_hemisphere(uv);
    s.wi.z *= sel((wo.z < 0.0f) == crossed, (real)(1.0f), (real)(-1.0f));
    s.pdf = diffuse_transmission_pdf(m, wo, s.wi);
    Spectrum share = diffuse_transmission_share(m, crossed);
    s.weight = spectrum_scale(share, 1.0f / sel(crossed, p, max_r(1.0f - p, (real)(1e-20f))));
    s.lobe = sel_i(crossed, (integer)(LOBE_TRANSMIT), (integer)(LOBE_REFLECT));
    return s;
}

Spectrum diffuse_transmission_albedo(DiffuseTransmission m)
{
    return spectrum_add(diffuse_transmission_share(m, mask_of(0)), diffuse_transmission_share(m, mask_of(1)));
}
