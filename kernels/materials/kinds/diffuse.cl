/* Lambertian reflection of the front: f = reflectance / pi [1/sr]. */
BsdfSample diffuse_sample(Diffuse m, vec3 wo, vec3 u)
{
    BsdfSample s = bsdf_nothing();
    vec2 uv = {u.x, u.y};
    s.wi = cosine_hemisphere(uv);
    s.pdf = sel(wo.z > 0.0f, cosine_hemisphere_pdf(s.wi.z), (real)(0.0f));
    s.weight = m.reflectance;
    return s;
}

Spectrum diffuse_eval(Diffuse m, vec3 wo, vec3 wi)
{
    mask front = (wo.z > 0.0f) & (wi.z > 0.0f);
    return spectrum_scale(m.reflectance, sel(front, wi.z * INV_PI, (real)(0.0f)));
}

real diffuse_pdf(Diffuse m, vec3 wo, vec3 wi)
{
    return sel(wo.z > 0.0f, cosine_hemisphere_pdf(wi.z), (real)(0.0f));
}

Spectrum diffuse_albedo(Diffuse m) { return m.reflectance; }

DiffuseLobe diffuse_diffuse_lobe(Diffuse m, vec3 wo)
{
    DiffuseLobe lobe = {m.reflectance, (real)(0.0f), (real)(0.0f), (real)(0.0f)};
    return lobe;
}
