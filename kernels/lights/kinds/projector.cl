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
    vec3 to = sub3(l.position, p);
    real t2 = max_r(dot3(to, to), (real)(1e-20f)), t = sqrt(t2), z;
    vec2 uv;
    LightSample s;
    s.wi = scale3(to, 1.0f / t);
    s.t = t;
    mask shone = projector_uv(l, neg3(s.wi), &z, &uv);
    Spectrum value = projector_irradiance(l, scene, uv, lambdas);
    s.radiance = spectrum_scale(value, 1.0f / (z * z * z * t2)); /* even over a plane across the axis: 1 / cos^3 */
    s.pdf = sel(shone, (real)(-1.0f), (real)(0.0f));
    return s;
}
