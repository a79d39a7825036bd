/* A pinhole camera in reverse (Mitsuba's projector): the image that stands a metre before it, seen from
 * behind, with x to the left and y up. `irradiance` times the image is what arrives there in the middle. */
inline mask projector_uv(Projector l, vec3 d, real *z, vec2 *uv)
{
    mask before = dot3(d, l.z) > 0.0f;
    *z = sel(before, dot3(d, l.z), (real)(1.0f));
    uv->x = 0.5f - 0.5f * dot3(d, l.x) / *z;
    uv->y = 0.5f + 0.5f * dot3(d, l.y) / *z;
    return before & (uv->x >= 0.0f) & (uv->x <= 1.0f) & (uv->y >= 0.0f) & (uv->y <= 1.0f);
}

/* On the plane of the image. */
inline Spectrum projector_irradiance(Projector l, Scene scene, vec2 uv, Wavelengths lambdas)
{
    TexturePoint point = texture_point(uv, l.position);
    Spectrum value = emission_load(scene, l.radiance, point, lambdas);
    return spectrum_scale(spectrum_mul(value, factor_load(scene, l.factor, point, lambdas)), l.scale);
}

LightSample projector_sample(Projector l, Scene scene, vec3 p, vec2 u, Wavelengths lambdas)
{
    real t2, z;
    vec2 uv;
    LightSample s = light_toward(l.position, p, &t2);
    mask shone = projector_uv(l, neg3(s.wi), &z, &uv);
    Spectrum value = projector_irradiance(l, scene, uv, lambdas);
    s.radiance = spectrum_scale(value, 1.0f / (z * z * z * t2)); /* even over a plane across the axis: 1 / cos^3 */
    s.pdf = sel(shone, (real)(-1.0f), (real)(0.0f));
    return s;
}

/* Step emission: a projector sends its rays through the image that stands a metre before it, evenly over the area. */
LightRay projector_emit(Projector l, Scene scene, vec2 u, vec2 v, Wavelengths lambdas)
{
    real x2 = dot3(l.x, l.x), y2 = dot3(l.y, l.y);
    vec3 across = scale3(l.x, (1.0f - 2.0f * v.x) / x2), up = scale3(l.y, (2.0f * v.y - 1.0f) / y2);
    LightRay r = light_ray_along(l.position, normalize3(add3(l.z, add3(across, up))));
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
