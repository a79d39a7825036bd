/* A projector sends its rays through the image that stands a metre before it, evenly over the area. */
LightRay projector_emit(Projector l, Scene scene, vec2 u, vec2 v, Wavelengths lambdas)
{
    real x2 = dot3(l.x, l.x), y2 = dot3(l.y, l.y);
    vec3 across = scale3(l.x, (1.0f - 2.0f * v.x) / x2), up = scale3(l.y, (2.0f * v.y - 1.0f) / y2);
    LightRay r = light_ray_nothing();
    r.o = l.position;
    r.d = normalize3(add3(l.z, add3(across, up)));
    r.n = r.d;
    real area = 4.0f / sqrt(x2 * y2); /* [m^2] */
    r.power = spectrum_scale(projector_irradiance(l, scene, v, lambdas), area);
    return r;
}

/* Even over the image's plane. */
Spectrum projector_intensity(Projector l, Scene scene, vec3 d, Wavelengths lambdas)
{
    real z;
    vec2 uv;
    mask shone = projector_uv(l, d, &z, &uv);
    Spectrum value = spectrum_scale(projector_irradiance(l, scene, uv, lambdas), 1.0f / (z * z * z));
    return spectrum_sel(shone, value, spectrum_of(0.0f));
}

/* dA = d omega / cos^3 on the image's plane. */
real projector_emit_pdf(Projector l, vec3 d)
{
    real cos_t = max_r(dot3(d, l.z), (real)(1e-6f));
    return 0.25f * sqrt(dot3(l.x, l.x) * dot3(l.y, l.y)) / (cos_t * cos_t * cos_t);
}
